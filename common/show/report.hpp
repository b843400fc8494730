// The report of a session: one self-contained HTML file with inline SVG, no script and no outside resource, for a
// browser in a hospital and for paper.
#pragma once

#include <string>

#include "common/judge/metrics.hpp"

namespace farhand {

std::string report_html(const Session& session, const scene::Scene& scene, const Metrics& metrics);

// The page around any report: its head, its looks. title is text, body is HTML.
std::string html_page(const std::string& title, const std::string& body);
// What the program was built with, in words.
std::string library_versions();

}  // namespace farhand
