// The report of a session: one self-contained HTML file with inline SVG, no script and no outside resource, for a
// browser in a hospital and for paper.
#pragma once

#include <filesystem>
#include <string>

#include "common/record/metrics.hpp"

namespace farhand {

std::string report_html(const Session& session, const scene::Scene& scene, const Metrics& metrics);

// Throws std::runtime_error with the path if the file cannot be written.
void write_report(const Session& session, const scene::Scene& scene, const Metrics& metrics,
                  const std::filesystem::path& path);

}  // namespace farhand
