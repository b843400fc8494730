// The report of a session: one self-contained HTML file with inline SVG, no script and no outside resource, for a
// browser in a hospital and for paper.
#pragma once

#include <string>

#include "common/judge/metrics.hpp"

namespace farhand {

std::string report_html(const Session& session, const scene::Scene& scene, const Metrics& metrics);

// The page of any report: its head and its style. title is text, body is HTML.
std::string html_page(const std::string& title, const std::string& body);
// Versions of the libraries with which the program was built, as text.
std::string library_versions();

}  // namespace farhand
