// A sweep against single runs: every setting of a scene, every architecture; its bytes, its ranges, what it refuses.
#include "netem/lab/sweep.hpp"

#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <stdexcept>

#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/judge/summary.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using Sets = std::vector<std::string>;
using Cells = std::vector<std::string>;

// Engaged at 0.9 s, then moved into contact.
const std::string kSession = R"(architecture: FOUR_CHANNEL
duration_s: 2.5
control { K_f_per_kgm2: 125 }
master { therapist { grip: FIRM intended { duration_s: 0.8 } intended { duration_s: 0.5 ramp_to_rad: 0.2 }
                     intended { duration_s: 5 } } }
slave { hand { stiffness_nm_per_rad: 5 } }
network { forward { delay_s: 0.02 distribution: UNIFORM jitter_s: 0.004 loss: 0.01 }
          backward { delay_s: 0.02 distribution: NORMAL_DISTRIBUTION jitter_s: 0.002 } }
windows { contact { from_s: 1.5 until_s: 2.5 } }
operator_acts { at_s: 0.1 act: ENGAGE }
)";

Cells cells_of(const std::string& line) {
  Cells cells(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

struct Table {
  std::string text;
  Cells head;
  std::vector<Cells> rows;
  Swept swept;

  const std::string& at(std::size_t row, const std::string& column) const {
    const auto found = std::ranges::find(head, column);
    if (found == head.end()) throw std::logic_error("no column " + column);
    return rows.at(row).at(static_cast<std::size_t>(found - head.begin()));
  }
};

Table table_of(const std::string& scene, const Sets& sets, int threads = 2) {
  Table table;
  std::ostringstream out;
  table.swept = sweep(swept(scene, sets, {}), threads, out);
  table.text = out.str();
  std::istringstream lines(table.text);
  std::string line;
  std::getline(lines, line);
  table.head = cells_of(line);
  while (std::getline(lines, line)) {
    table.rows.push_back(cells_of(line));
    EXPECT_EQ(table.rows.back().size(), table.head.size()) << line;
  }
  return table;
}

// The numbers of summary.json as they stand there.
std::map<std::string, std::string> numbers_of(const std::string& json) {
  std::map<std::string, std::string> all;
  std::istringstream lines(json);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t key = line.find('"'), end = line.find("\": ", key + 1);
    if (key != 2 || end == std::string::npos) continue;
    std::string value = line.substr(end + 3);
    if (value.ends_with(',')) value.pop_back();
    if (value == "null") value.clear();
    if (!value.starts_with('"') && !value.starts_with('[')) all[line.substr(3, end - 3)] = value;
  }
  return all;
}

void expect_what_run_says(const Table& table, std::size_t row, const std::string& scene, const Sets& sets) {
  std::string refusal;
  std::map<std::string, std::string> expected;
  try {
    const LoadedScene loaded = load_scene(scene, sets, {});
    expected = numbers_of(summary_json(compute_metrics(simulate(loaded), loaded.scene), false));
    EXPECT_GT(expected.size(), 20u);
  } catch (const std::exception& refused) {
    refusal = refused.what();
    std::ranges::replace(refusal, '\n', ' ');
    std::erase(refusal, '"');
  }
  EXPECT_EQ(table.at(row, "refused"), refusal) << sets.back();
  for (const auto& [key, value] : expected) EXPECT_EQ(table.at(row, key), value) << key << " with " << sets.back();
}

// "field=from:to:2" for every numeric field that a scene holds: its value, and another one.
void swept_fields(const Message& message, const std::string& prefix, Sets& sets) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const bool there = field.is_repeated() || message.GetReflection()->HasField(message, &field);
    if (field.is_repeated() || !there) continue;
    const std::string path = prefix + field.name();
    if (field.message_type() != nullptr) {
      swept_fields(message.GetReflection()->GetMessage(message, &field), path + ".", sets);
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
      const double now = message.GetReflection()->GetDouble(message, &field);
      sets.push_back(path + "=" + shortest(now) + ":" + shortest(now == 0.0 ? 0.1 : 0.8 * now) + ":2");
    }
  }
}

std::size_t expect_every_setting_as_run_says_it(const Sets& more) {
  ScratchDirectory scratch;
  const std::string scene = (scratch / "session.txtpb").string();
  write_bytes(scene, kSession);
  Sets fields;
  swept_fields(load_scene(scene, more, {}).scene, "", fields);
  for (const std::string& field : fields) {
    Sets sets = more;
    sets.push_back(field);
    const Table table = table_of(scene, sets);
    EXPECT_EQ(table.rows.size(), 2u) << field;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      sets.back() = table.head[0].substr(4) + "=" + table.rows[row][0];  // set.FIELD
      expect_what_run_says(table, row, scene, sets);
    }
  }
  return fields.size();
}

TEST(Sweep, SaysOfEverySettingWhatRunSays) { EXPECT_GT(expect_every_setting_as_run_says_it({}), 100u); }

TEST(NightlySweep, SaysOfEverySettingWhatRunSaysInEveryArchitecture) {
  for (const char* architecture : {"FOUR_CHANNEL_CDOB_SDCV", "MODEL_MEDIATED", "AUTOMATIC", "FOUR_CHANNEL_TANK",
                                   "TWO_CHANNEL", "TWO_CHANNEL_PO_PC", "WAVE"}) {
    for (const char* device : {"DIRECT_DRIVE", "SERIES_ELASTIC"}) {
      expect_every_setting_as_run_says_it(
          {std::string("architecture=") + architecture, std::string("slave.device=") + device});
    }
  }
}

TEST(Sweep, KnowsEveryArchitectureNetworkAndDevice) {
  for (const char* scene : {"four_channel", "four_channel_cdob", "four_channel_cdob_sdcv", "four_channel_mediated",
                            "auto_detour", "four_channel_tank", "two_channel", "two_channel_po_pc", "wave",
                            "sea_four_channel_mediated", "outage", "therapist_reaction"}) {
    const Table table = table_of(scene, {"network.forward.loss=0:0.1:2"});
    ASSERT_EQ(table.rows.size(), 2u) << scene;
    EXPECT_EQ(table.at(0, "refused"), "");
    EXPECT_NE(table.at(0, "loss"), table.at(1, "loss")) << scene;
    expect_what_run_says(table, 1, scene, {"network.forward.loss=0.1"});
  }
}

TEST(Sweep, TellsALossThatEndsASessionFromOneThatDoesNot) {
  const Table table = table_of("four_channel", {"network.forward.loss=0:0.9:3"});
  EXPECT_EQ(table.at(0, "verdict"), "degraded");
  EXPECT_EQ(table.at(2, "verdict"), "failed");
  EXPECT_EQ(table.swept.rows, 3u);
  EXPECT_GE(table.swept.failed, 1u);
  EXPECT_NE(table.at(2, "reasons"), "");
}

TEST(Sweep, GivesTheSameBytesForAnyNumberOfThreads) {
  const Sets sets = {"network.forward.delay_s=0:0.1:3", "slave.hand.stiffness_nm_per_rad=2:8:2"};
  const std::string one = table_of("demo", sets, 1).text;
  for (const int threads : {2, 3}) EXPECT_EQ(table_of("demo", sets, threads).text, one);
}

TEST(Sweep, TheLastRangeRunsFastestAndSettingsMayGoTogether) {
  const Table table =
      table_of("zero_delay", {"seed=1:2:2", "network.forward.delay_s,network.backward.delay_s=0:0.02:3"});
  ASSERT_EQ(table.rows.size(), 6u);
  EXPECT_EQ(table.head[0], "set.seed");
  EXPECT_EQ(table.head[1], "set.network.forward.delay_s+network.backward.delay_s");
  EXPECT_EQ(table.rows[2][0], "1");
  EXPECT_EQ(table.rows[2][1], "0.02");
  EXPECT_EQ(table.rows[3][0], "2");
  expect_what_run_says(table, 5, "zero_delay",
                       {"seed=2", "network.forward.delay_s=0.02", "network.backward.delay_s=0.02"});
  // A setting of a whole group is no range, colons or not.
  EXPECT_EQ(table_of("zero_delay", {"network.forward={delay_s: 0.01}"}).rows.size(), 1u);
}

TEST(Sweep, KeepsTheRowOfASceneThatIsRefused) {
  const Table table = table_of("zero_delay", {"master.motor.J_kgm2=-0.001:0.004:2"});
  EXPECT_EQ(table.swept.refused, 1u);
  EXPECT_NE(table.at(0, "refused").find("master.motor.J_kgm2"), std::string::npos) << table.text;
  EXPECT_EQ(table.at(0, "verdict"), "");
  EXPECT_EQ(table.at(1, "refused"), "");
}

TEST(Sweep, SaysAMistakeThatIsInEverySceneBeforeAnythingRuns) {
  for (const char* set : {"master.motor.j_kgm2=0.003:0.004:2", "master.motor.J_kgm2=-2:-1:2", "master=1:2:2"}) {
    std::ostringstream out;
    EXPECT_ANY_THROW(sweep(swept("zero_delay", {set}, {}), 2, out)) << set;
    EXPECT_EQ(out.str(), "") << set;
  }
}

TEST(Sweep, RefusesARangeThatIsNone) {
  for (const char* set : {"seed=1:2", "seed=1:2:0", "seed=1:2:x", "seed=:2:3", "seed=1:2:3:4", "seed,=1:2:3",
                          "seed,duration_s=3", "seed=1:2:-3", "seed=1:inf:2", "seed=1:2:1"}) {
    try {
      swept("demo", {set}, {});
      FAIL() << set;
    } catch (const std::invalid_argument& refused) {
      EXPECT_NE(std::string(refused.what()).find(set), std::string::npos) << refused.what();
    }
  }
  EXPECT_NO_THROW(swept("demo", {"seed=2:2:1", "slave.hand=<stiffness_nm_per_rad: 5>", "description=\"a: b\""}, {}));
  EXPECT_THROW(swept("demo", {"seed=1:2:1001", "duration_s=20:30:1000"}, {}), std::invalid_argument);
  EXPECT_NO_THROW(swept("demo", {"seed=1:2:1000", "duration_s=20:30:1000"}, {}));
}

// Else a column would tell of a value that did not run.
TEST(Sweep, RefusesAFieldThatIsGivenTwice) {
  for (const Sets& sets : {Sets{"seed=1:2:2", "seed=3"}, Sets{"seed=1:2:2", "seed=3:4:2"}, Sets{"seed,seed=1:2:2"},
                           Sets{"seed=3", "seed=1:2:2"}}) {
    EXPECT_THROW(swept("demo", sets, {}), std::invalid_argument) << sets.back();
  }
  EXPECT_THROW(swept("demo", {"seed=1:2:2"}, 5), std::invalid_argument);
  EXPECT_NO_THROW(swept("demo", {"duration_s=20:30:2"}, 5));
}

TEST(Sweep, WarnsOfASceneAsRunDoes) {
  const Table table = table_of("four_channel_wall", {"slave.wall.stiffness_nm_per_rad=1e3:1e8:2"});
  EXPECT_EQ(table.at(0, "warnings"), "");
  EXPECT_NE(table.at(1, "warnings").find("hammers on"), std::string::npos) << table.at(1, "warnings");
}

TEST(Sweep, EndsAtTheFirstRowThatCannotBeWritten) {
  std::ostringstream out;
  out.setstate(std::ios::badbit);
  EXPECT_THROW(sweep(swept("zero_delay", {"seed=1:1000:1000"}, {}), 2, out), std::runtime_error);
}

}  // namespace
}  // namespace farhand
