// Recordings for other tools: CSV, one file per topic, and MAT level 4 (MATLAB, Octave, scipy). The first column is
// t_s, the time since the start of the run. The others are the fields of record.proto in their order, with the unit in
// the name. Numbers are written so that reading gives the same double, in every locale.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace farhand {

struct Exported {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> problems;  // damage of the recording, in sentences; what could be read was exported
};

// Writes directory/TOPIC.csv for each topic with messages, and directory/info.txtpb with the scene and the counters;
// where there is one of them, all are numbered (TOPIC-2.csv). What a side could not know is an empty cell. Both throw
// std::runtime_error when a file cannot be read or written.
Exported export_csv(const std::filesystem::path& recording, const std::filesystem::path& directory);

// Writes, per topic, a matrix TOPIC with one row per message and a text TOPIC_columns with one row per column; texts of
// messages become TOPIC_FIELD. What a side could not know is NaN.
Exported export_mat(const std::filesystem::path& recording, const std::filesystem::path& mat_file);

}  // namespace farhand
