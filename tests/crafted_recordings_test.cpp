// Recordings that no program of ours would write, whole and with right checksums: stamps and numbers at every extreme.
// Report, export, identify and compare end with a result or a sentence; under sanitizers nothing in them is undefined.
// FARHAND_CRAFTED is the number of recordings, 80 without it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <sstream>

#include "common/config/load.hpp"
#include "common/judge/metrics.hpp"
#include "common/judge/summary.hpp"
#include "common/record/export.hpp"
#include "common/record/merge.hpp"
#include "common/record/recording.hpp"
#include "common/show/report.hpp"
#include "netem/lab/compare.hpp"
#include "netem/lab/compare_report.hpp"
#include "netem/lab/identify.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

// Draws what a session holds, and now and then the end of a range in its place.
class Crafted {
 public:
  explicit Crafted(std::uint64_t seed) : random_(seed) {}

  // 0: honest; else one in `rarity` is an extreme.
  int rarity() { return rarity_; }
  void next_session() { rarity_ = std::array{0, 1, 2, 10, 100}[below(5)]; }
  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  bool odd() { return rarity_ > 0 && below(static_cast<std::uint64_t>(rarity_)) == 0; }

  Nanoseconds stamp(Nanoseconds honest) {
    constexpr Nanoseconds kFirst = std::numeric_limits<Nanoseconds>::min(),
                          kLast = std::numeric_limits<Nanoseconds>::max();
    if (!odd()) return honest;
    const Nanoseconds all[] = {kFirst, kFirst + 1, kFirst / 2, -kSecond, -1,      0,
                               1,      kLast / 2,  kLast - 1,  kLast,    kSecond, static_cast<Nanoseconds>(random_())};
    return all[below(std::size(all))];
  }
  double number(double honest) {
    using Limits = std::numeric_limits<double>;
    if (!odd()) return honest;
    const double all[] = {Limits::quiet_NaN(),
                          Limits::infinity(),
                          -Limits::infinity(),
                          Limits::max(),
                          Limits::lowest(),
                          Limits::min(),
                          Limits::denorm_min(),
                          -0.0,
                          1e18,
                          -9.3e9};
    return all[below(std::size(all))];
  }

 private:
  std::mt19937_64 random_;
  int rarity_ = 0;
};

record::RunInfo info_of(const std::string& role, Nanoseconds start, const std::string& scene, Crafted& crafted) {
  record::RunInfo info;
  info.set_role(role);
  info.set_scene_name("crafted");
  info.set_scene_text(scene);
  info.set_seed(7);
  info.set_start_ns(crafted.stamp(start));
  info.set_start_utc_ns(crafted.stamp(1'800'000'000 * kSecond));
  info.set_clock_id(crafted.below(2) == 0 ? "same" : role);
  // As it was before signals had names; or more or fewer of them than there are values, with names that are none.
  if (crafted.below(2) == 0) return info;
  const std::string odd[] = {"share", "energy_j", "x_rad", "a,b\n", "", std::string(5000, 'k'), "t_s"};
  std::vector<std::string> names[2];
  for (std::vector<std::string>& side : names) {
    for (std::uint64_t k = crafted.below(12); k > 0; --k) side.push_back(odd[crafted.below(std::size(odd))]);
  }
  name_signals(names[0], names[1], info);
  return info;
}

StationSample station_sample(Nanoseconds t, double t_s, Crafted& crafted) {
  StationSample sample;
  sample.state = crafted.odd() ? static_cast<int>(crafted.stamp(0)) : static_cast<int>(crafted.below(8));
  for (double* field : {&sample.x_rad, &sample.remote_x_rad, &sample.target_x_rad, &sample.true_x_rad})
    *field = crafted.number(0.3 * std::sin(t_s));
  for (double* field : {&sample.v_rad_s, &sample.f_nm, &sample.remote_v_rad_s, &sample.remote_f_nm, &sample.command_nm,
                        &sample.true_v_rad_s, &sample.true_f_nm, &sample.x_cdob_rad, &sample.alpha, &sample.law[0],
                        &sample.law[1], &sample.law[2], &sample.playout_delay_s, &sample.rtt_s})
    *field = crafted.number(0.3 * std::cos(t_s));
  sample.limits = static_cast<std::uint32_t>(crafted.stamp(0));
  sample.newest_peer_send_ns = crafted.stamp(t - 50 * kMillisecond);
  sample.newest_peer_arrival_ns = crafted.stamp(t);
  return sample;
}

void craft(const fs::path& directory, const std::string& scene, Crafted& crafted) {
  constexpr Nanoseconds kStart = 1000 * kSecond;
  const std::uint64_t rows = 20 + crafted.below(400);
  for (const std::string role : {"master", "slave", "netem", "mcu"}) {
    Recording recording(directory / (role + ".mcap"), info_of(role, kStart, scene, crafted));
    for (std::uint64_t k = 0; k < rows; ++k) {
      const Nanoseconds honest = kStart + static_cast<Nanoseconds>(k) * 10 * kMillisecond;
      const Nanoseconds t = crafted.stamp(honest);
      const double t_s = 0.01 * static_cast<double>(k);
      if (role == "netem") {
        recording.write(
            t, LinkSample{0, crafted.below(2) == 0, crafted.below(9) == 0, crafted.number(0.1), crafted.number(0.1)});
      } else if (role == "mcu") {
        McuSample sample;
        for (double* field : {&sample.true_x_rad, &sample.true_v_rad_s, &sample.true_f_nm, &sample.motor_x_rad,
                              &sample.spring_torque_nm})
          *field = crafted.number(0.2 * std::sin(t_s));
        recording.write(t, sample);
      } else {
        recording.write(t, station_sample(honest, t_s, crafted));
      }
      if (crafted.below(50) == 0) recording.write(crafted.stamp(honest), Note("engaged: operator"));
    }
    StationCounters counters;
    for (std::uint64_t* count : {&counters.ticks, &counters.overruns, &counters.missed_ticks, &counters.received,
                                 &counters.late, &counters.lost, &counters.sent})
      *count = static_cast<std::uint64_t>(crafted.stamp(1000));
    ASSERT_EQ(recording.finish(counters).problem, "");
  }
}

// How often a use came to a result, and how often to a sentence.
struct Uses {
  int results = 0, sentences = 0;

  template <class Use>
  void add(const Use& use) {
    try {
      use();
      ++results;
    } catch (const std::invalid_argument& error) {
      EXPECT_STRNE(error.what(), "");
      ++sentences;
    } catch (const std::runtime_error& error) {
      EXPECT_STRNE(error.what(), "");
      ++sentences;
    }
  }
};

TEST(CraftedRecordings, EveryUseEndsWithAResultOrASentence) {
  const char* asked = std::getenv("FARHAND_CRAFTED");
  const int sessions = (asked != nullptr ? std::atoi(asked) : 80) / 4;
  const std::string scene = complete_text(load_scene("zero_delay").scene);
  Crafted crafted(20'261'130);
  Uses reports, exports, identifications, comparisons;
  for (int k = 0; k < sessions; ++k) {
    SCOPED_TRACE("session " + std::to_string(k));
    ScratchDirectory scratch;
    crafted.next_session();
    craft(scratch.path(), scene, crafted);
    reports.add([&] {
      const Session session = merge_recordings(scratch.path());
      const scene::Scene from = load_scene_text(session.scene_text, "crafted").scene;
      const Metrics metrics = compute_metrics(session, from);
      EXPECT_FALSE(summary_json(metrics, true).empty());
      EXPECT_FALSE(report_html(session, from, metrics).empty());
      read_session_mcap(write_session_mcap(session, scratch / "session.mcap"));
    });
    for (const char* role : {"master", "slave", "netem", "mcu"}) {
      const fs::path file = scratch / (std::string(role) + ".mcap");
      exports.add([&] {
        EXPECT_TRUE(export_csv(file, scratch / "csv").problems.empty());
        EXPECT_TRUE(export_mat(file, scratch / "all.mat").problems.empty());
      });
      identifications.add([&] {
        const Identified found = identify_recording(file.string(), "");
        std::ostringstream text;
        print_identified(found, text);
        EXPECT_FALSE((text.str() + json_of(found).dump(0)).empty());
      });
    }
    comparisons.add([&] {
      ComparisonAsked ask;
      ask.sessions = {scratch.path().string()};
      const std::vector<ComparedSession> compared = compared_sessions(ask);
      EXPECT_FALSE((comparison_html(compared) + comparison_json(compared) + comparison_text(compared)).empty());
    });
  }
  for (const auto& [what, uses] : {std::pair{"report", &reports}, std::pair{"export", &exports},
                                   std::pair{"identify", &identifications}, std::pair{"compare", &comparisons}})
    std::printf("%-9s %5d results, %5d sentences\n", what, uses->results, uses->sentences);
  EXPECT_GT(reports.results, sessions / 2);
  EXPECT_EQ(exports.results, 4 * sessions);
  EXPECT_GT(identifications.results, sessions / 2);
  EXPECT_GT(comparisons.results, sessions / 2);
}

}  // namespace
}  // namespace farhand
