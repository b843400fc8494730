// What is recorded: every column of the table and every signal of a law reaches CSV, MCAP and what is exported of it.
#include "common/record/columns.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "common/judge/summary.hpp"
#include "common/law/architectures.hpp"
#include "common/record/export.hpp"
#include "common/record/mcap_writer.hpp"
#include "common/record/session_file.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

std::vector<std::string> cells_of(const std::string& text) {
  std::vector<std::string> cells;
  std::istringstream line(text.substr(0, text.find('\n')));
  for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
  return cells;
}

std::set<std::string> as_set(const std::vector<std::string>& names) { return {names.begin(), names.end()}; }

// The table, and what besides stands in a row of the lab's CSV.
std::set<std::string> expected_columns(std::set<std::string> beside, const std::vector<std::string>& signals) {
  for (const auto& column : kStationColumns) beside.insert(std::string(column.name));
  beside.insert(signals.begin(), signals.end());
  return beside;
}

// A matrix of text in a MAT file of level 4: rows and columns in its header, then its name, then column by column.
std::vector<std::string> names_in_mat(const std::string& mat, const std::string& name) {
  const std::size_t at = mat.find(name + std::string(1, '\0'));
  std::uint32_t rows = 0, columns = 0;
  std::memcpy(&rows, mat.data() + at - 16, sizeof rows);
  std::memcpy(&columns, mat.data() + at - 12, sizeof columns);
  std::vector<std::string> names(rows);
  for (std::size_t k = 0; k < std::size_t{rows} * columns; ++k) names[k % rows] += mat[at + name.size() + 1 + k];
  for (std::string& one : names) one.erase(one.find_last_not_of(' ') + 1);
  return names;
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(FARHAND_SCENES))
    if (entry.path().extension() == ".txtpb") names.push_back(entry.path().stem());
  std::ranges::sort(names);
  return names;
}

// By architecture a shipped scene; each is run for its first seconds.
std::map<std::string, LoadedScene> a_scene_each() {
  std::map<std::string, LoadedScene> all;
  for (const std::string& name : scene_names()) {
    LoadedScene loaded = load_scene(name);
    all.try_emplace(scene::Architecture_Name(loaded.scene.architecture()), loaded);
  }
  return all;
}

TEST(Columns, OfCsvMcapAndExportsAreTheTableAndTheSignalsOfTheLaw) {
  const auto scenes = a_scene_each();
  ASSERT_EQ(scenes.size(), architectures().size());
  for (const Architecture& laws : architectures()) {
    LoadedScene loaded = scenes.at(std::string(laws.name));
    loaded.scene.set_duration_s(2.5);
    const Session session = simulate(loaded);
    EXPECT_EQ(session.master_signals, names_of(laws.master.signals)) << laws.name;
    EXPECT_EQ(session.slave_signals, names_of(laws.slave.signals)) << laws.name;
    std::vector<std::string> both = session.master_signals;
    both.insert(both.end(), session.slave_signals.begin(), session.slave_signals.end());

    std::ostringstream csv;
    write_csv(session, csv);
    EXPECT_EQ(as_set(cells_of(csv.str())), expected_columns({"side", "t_s", "state", "limits"}, both)) << laws.name;

    ScratchDirectory scratch;
    const auto file = write_session_mcap(session, scratch / "session.mcap");
    const Session read = read_session_mcap(file);
    EXPECT_EQ(read.master_signals, session.master_signals);
    EXPECT_EQ(read.slave_signals, session.slave_signals);
    ASSERT_EQ(read.master.size(), session.master.size());
    std::ostringstream again;
    write_csv(read, again);
    EXPECT_EQ(again.str().substr(0, again.str().find('\n')), csv.str().substr(0, csv.str().find('\n')));
    for (std::size_t k = 0; k < read.master.size(); ++k) {
      for (std::size_t i = 0; i < kMostLawSignals; ++i) {
        const double was = session.master[k].law[i], is = read.master[k].law[i];
        ASSERT_TRUE(was == is || (std::isnan(was) && std::isnan(is))) << laws.name << ' ' << k << ' ' << i;
      }
    }

    export_csv(file, scratch / "csv");
    for (const auto& [side, signals] :
         {std::pair{"master", session.master_signals}, std::pair{"slave", session.slave_signals}}) {
      const std::string text = file_bytes(scratch / "csv" / (std::string(side) + ".csv"));
      EXPECT_EQ(as_set(cells_of(text)),
                expected_columns({"t_s", "t_ns", "state", "limits", "newest_peer_send_ns", "newest_peer_arrival_ns"},
                                 signals))
          << laws.name << ' ' << side;
    }
    export_mat(file, scratch / "session.mat");
    const std::string mat = file_bytes(scratch / "session.mat");
    for (const auto& [side, signals] :
         {std::pair{"master", session.master_signals}, std::pair{"slave", session.slave_signals}}) {
      const std::vector<std::string> columns = names_in_mat(mat, std::string(side) + "_columns");
      EXPECT_EQ(as_set(columns),
                expected_columns({"t_s", "t_ns", "state", "limits", "newest_peer_send_ns", "newest_peer_arrival_ns"},
                                 signals))
          << laws.name << ' ' << side;
    }
  }
}

// A signal that no shipped scene shows is one that nobody has looked at.
TEST(Columns, EverySignalIsShownByAShippedScene) {
  std::map<std::string, std::set<std::string>> shown;
  for (const std::string& name : scene_names()) {
    const LoadedScene loaded = load_scene(name);
    const Session session = simulate(loaded);
    for (const auto& [side, rows, signals] :
         {std::tuple{std::string("master "), &session.master, &session.master_signals},
          std::tuple{std::string("slave "), &session.slave, &session.slave_signals}}) {
      for (const StationSample& row : *rows) {
        for (std::size_t i = 0; i < signals->size(); ++i) {
          if (!std::isnan(row.law[i]))
            shown[scene::Architecture_Name(loaded.scene.architecture())].insert(side + (*signals)[i]);
        }
        for (std::size_t i = signals->size(); i < row.law.size(); ++i) ASSERT_TRUE(std::isnan(row.law[i])) << name;
      }
    }
  }
  for (const Architecture& laws : architectures()) {
    std::set<std::string> all;
    for (const LawSignal& signal : laws.master.signals) all.insert("master " + std::string(signal.name));
    for (const LawSignal& signal : laws.slave.signals) all.insert("slave " + std::string(signal.name));
    EXPECT_EQ(shown[std::string(laws.name)], all) << laws.name;
  }
}

TEST(Columns, NamesEndInTheirUnitAndStandOnce) {
  const std::map<std::string, std::string> ends{
      {"rad", "_rad"}, {"rad/s", "_rad_s"}, {"N m", "_nm"}, {"s", "_s"}, {"N m/rad", "_nm_per_rad"},
      {"J", "_j"},     {"us", "_us"},       {"1", ""}};
  std::set<std::string> table;
  const auto check = [&](std::string_view name, std::string_view unit, std::string_view meaning) {
    ASSERT_TRUE(ends.contains(std::string(unit))) << name << ' ' << unit;
    EXPECT_TRUE(name.ends_with(ends.at(std::string(unit)))) << name;
    EXPECT_FALSE(meaning.empty()) << name;
  };
  for (const auto& column : kStationColumns) {
    check(column.name, column.unit, column.meaning);
    EXPECT_TRUE(table.insert(std::string(column.name)).second) << column.name;
  }
  for (const auto& column : kLinkColumns) check(column.name, column.unit, column.meaning);
  for (const auto& column : kMcuColumns) check(column.name, column.unit, column.meaning);
  for (const auto& column : kCounterColumns) check(column.name, column.unit, column.meaning);
  for (const Architecture& laws : architectures()) {
    for (const auto& signals : {laws.master.signals, laws.slave.signals}) {
      std::set<std::string> names = table;
      for (const LawSignal& signal : signals) {
        check(signal.name, signal.unit, signal.meaning);
        EXPECT_TRUE(names.insert(std::string(signal.name)).second) << laws.name << ' ' << signal.name;
      }
    }
  }
}

// Written field by field as it was before signals had names.
TEST(Columns, ARecordingFromBeforeIsReadAsItWas) {
  ScratchDirectory scratch;
  const std::filesystem::path file = scratch / "master.mcap";
  {
    McapWriter writer(file);
    const std::uint16_t info_channel = writer.add_channel("/info", *record::RunInfo::descriptor());
    const std::uint16_t channel = writer.add_channel("/master", *record::StationSample::descriptor());
    record::RunInfo info;
    info.set_role("session");
    writer.write(info_channel, 0, info.SerializeAsString());
    record::StationSample sample;
    sample.set_alpha(0.5);
    sample.set_energy_j(0.25);
    sample.set_f_2_nm(0.7);
    writer.write(channel, 1, sample.SerializeAsString());
    writer.close();
  }
  const Session session = read_session_mcap(file);
  ASSERT_EQ(session.master.size(), 1u);
  EXPECT_EQ(session.master[0].alpha, 0.5);
  EXPECT_EQ(law_signal(session.master[0], session.master_signals, "energy_j"), 0.25);
  EXPECT_TRUE(std::isnan(law_signal(session.master[0], session.master_signals, "friction_nm")));
  EXPECT_EQ(law_signal(session.master[0], session.master_signals, "f_2_nm"), 0.7);
  export_csv(file, scratch / "csv");
  const auto header = cells_of(file_bytes(scratch / "csv/master.csv"));
  ASSERT_GE(header.size(), 3u);
  EXPECT_EQ((std::vector<std::string>(header.end() - 3, header.end())),
            (std::vector<std::string>{"energy_j", "friction_nm", "f_2_nm"}));
}

// A file may come from anywhere: what stands at the head of a column is a name, and there are not too many.
TEST(Columns, NamesOfAFileAreNoMoreThanNames) {
  record::RunInfo info;
  std::vector<std::string> odd{"a,b", "x_rad", "", std::string(1000, 'a'), "good_nm", "\n", "six", "seven", "eight"};
  name_signals(odd, {}, info);
  EXPECT_EQ(signals_of(info, true), (std::vector<std::string>{"signal_1", "signal_2", "signal_3", "signal_4", "good_nm",
                                                              "signal_6", "six", "seven"}));
  EXPECT_TRUE(signals_of(info, false).empty());
}

}  // namespace
}  // namespace farhand
