// Hosts that stall: what the persons at either side feel of it, by the true torque of the simulated world, against the
// same session without a stall. Behind an MCU a stop of the slave's program for longer than the MCU waits is a stop:
// what the hand feels then is no more than before.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <map>
#include <mutex>
#include <span>
#include <thread>

#include "tests/support/stalled_session.hpp"

namespace farhand {
namespace {

constexpr double kMore = 0.1;     // N m
constexpr int kMcuWaits_ms = 16;  // of stops that the MCU rides over

constexpr const char* kArchitectures[] = {
    "FOUR_CHANNEL", "FOUR_CHANNEL_CDOB", "FOUR_CHANNEL_CDOB_SDCV", "MODEL_MEDIATED", "TWO_CHANNEL",
    "WAVE",         "FOUR_CHANNEL_TANK", "TWO_CHANNEL_PO_PC",      "AUTOMATIC",
};

// A reference that steps is led there at the limit of speed: nothing that a person feels. (A direct drive has none.)
constexpr std::uint32_t kOfReferences = kLimitRate | kLimitAcceleration | kLimitVelocity;

template <class Each>
void in_threads(std::size_t count, const Each& each) {
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (int k = 0; k < 2; ++k) {
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) each(i);
    });
  }
}

struct Base {
  std::string key(const StallCell& cell) const {
    return cell.architecture + cell.hand + '/' + std::to_string(cell.counts) + (cell.elastic ? 'e' : 'd') + cell.grip;
  }
  const AtPersons& operator()(const StallCell& cell) {
    const std::lock_guard lock(mutex);
    const auto [found, fresh] = known.try_emplace(key(cell));
    if (fresh) found->second = persons_of(cell.load(false));
    return found->second;
  }
  std::map<std::string, AtPersons> known;
  std::mutex mutex;
};

// What is more than kMore, as measured, and why.
struct Named {
  const char *architecture, *grip, *hand;
  double more;  // N m
};
// CDOB and light grips at 25 ms, and passivity control with firm ones, are at the end of their stability without any
// stop (below). A hand of 5 to 20 N m/rad that is let go of swings for a while, over laws that ask for a torque least
// damped, and is met by the torque that comes back.
constexpr Named kOnDirectDrives[] = {
    {"FOUR_CHANNEL_CDOB", "LIGHT", "20", 0.32},
    {"MODEL_MEDIATED", "LIGHT", "", 0.12},
    {"TWO_CHANNEL_PO_PC", "FIRM", "2", 0.23},
    {"AUTOMATIC", "LIGHT", "", 0.12},
    {"FOUR_CHANNEL", "NORMAL", "20", 0.12},
    {"FOUR_CHANNEL_CDOB_SDCV", "LIGHT", "20", 0.35},
    {"TWO_CHANNEL", "LIGHT", "5", 0.12},
    {"TWO_CHANNEL", "FIRM", "5", 0.16},
    {"TWO_CHANNEL", "LIGHT", "20", 0.19},
    {"TWO_CHANNEL", "NORMAL", "20", 0.18},
    {"TWO_CHANNEL", "FIRM", "20", 0.20},
    {"WAVE", "LIGHT", "20", 0.11},
    {"WAVE", "NORMAL", "20", 0.14},
    {"FOUR_CHANNEL_TANK", "LIGHT", "20", 0.11},
    {"FOUR_CHANNEL_TANK", "FIRM", "20", 0.12},
    {"TWO_CHANNEL_PO_PC", "FIRM", "5", 0.31},
    {"TWO_CHANNEL_PO_PC", "NORMAL", "20", 0.45},
    {"TWO_CHANNEL_PO_PC", "FIRM", "20", 0.24},
    {"TWO_CHANNEL_PO_PC", "LIGHT", "5", 0.14},
    {"TWO_CHANNEL_PO_PC", "LIGHT", "20", 0.17},
};
constexpr Named kBeforeAnMcu[] = {
    {"WAVE", "LIGHT", "20", 0.12},
    {"FOUR_CHANNEL_TANK", "LIGHT", "20", 0.17},
    {"TWO_CHANNEL_PO_PC", "FIRM", "5", 0.23},
    {"TWO_CHANNEL_PO_PC", "LIGHT", "20", 0.23},
    {"FOUR_CHANNEL_CDOB_SDCV", "NORMAL", "20", 0.11},
    {"TWO_CHANNEL", "LIGHT", "20", 0.20},
    {"TWO_CHANNEL", "NORMAL", "20", 0.12},
    {"TWO_CHANNEL_PO_PC", "FIRM", "2", 0.24},
    {"TWO_CHANNEL_PO_PC", "NORMAL", "20", 0.33},
    {"TWO_CHANNEL_PO_PC", "FIRM", "20", 0.27},
    {"FOUR_CHANNEL", "LIGHT", "5", 0.14},
    {"FOUR_CHANNEL", "LIGHT", "20", 0.23},
    {"FOUR_CHANNEL_CDOB", "LIGHT", "0.5", 0.19},
    {"FOUR_CHANNEL_CDOB_SDCV", "LIGHT", "0.5", 0.19},
    {"MODEL_MEDIATED", "LIGHT", "0.5", 0.21},
    {"AUTOMATIC", "LIGHT", "5", 0.11},
    {"AUTOMATIC", "LIGHT", "0.5", 0.21},
    {"FOUR_CHANNEL_CDOB", "NORMAL", "20", 0.24},
    {"TWO_CHANNEL_PO_PC", "FIRM", "", 0.14},
    {"TWO_CHANNEL_PO_PC", "LIGHT", "5", 0.15},
    {"TWO_CHANNEL_PO_PC", "NORMAL", "5", 0.12},
};

double more_of(const StallCell& cell) {
  double more = kMore;
  for (const Named& one :
       cell.elastic ? std::span<const Named>(kBeforeAnMcu) : std::span<const Named>(kOnDirectDrives)) {
    const bool is = one.architecture == cell.architecture && one.grip == cell.grip && one.hand == cell.hand;
    if (is) more = std::max(more, one.more);
  }
  return more;
}

// Who is pressed with that much is let go of by his drive while its program stops, and his own spring moves him: to
// his limits of speed, power and shaking, and the therapist to the end of his range. A light grip is not held there.
constexpr double kSpringsBack = 0.3;  // N m
constexpr double kMost = 3.1;         // N m, the torque limit and 0.1
constexpr std::uint32_t kOfSprings = kLimitTorque | kLimitRate | kLimitRange | kLimitVelocity | kLimitAcceleration |
                                     kLimitPower | kLimitShaking | kLimitDevice;

void expect_no_harder(const std::vector<StallCell>& cells) {
  Base base;
  std::vector<AtPersons> found(cells.size());
  in_threads(cells.size(), [&](std::size_t i) { base(cells[i]), found[i] = persons_of(cells[i].load()); });
  double therapist = -1, patient = -1;
  std::size_t named = 0, limited = 0, unstable = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const StallCell& cell = cells[i];
    const AtPersons &without = base(cell), &with = found[i];
    if (cell.told_unstable()) {  // it swings as far as its limits let it, stopped or not
      EXPECT_LE(std::max(with.therapist_nm, with.patient_nm), kMost) << cell.name();
      ++unstable;
      continue;
    }
    const bool let_go = cell.elastic && cell.stalls != "master" && cell.stall_ms > kMcuWaits_ms;
    const double most = more_of(cell), pressed = std::max(without.therapist_nm, without.patient_nm);
    const double more_m = let_go ? 0.0 : with.therapist_nm - without.therapist_nm;  // Off at the patient's side: held
    const double more_s = with.patient_nm - without.patient_nm;
    EXPECT_LE(more_s, most) << cell.name();
    EXPECT_LE(more_m, most) << cell.name();
    if (most > kMore) {
      if (std::max(more_m, more_s) > kMore) ++named;
    } else {
      therapist = std::max(therapist, more_m);
      patient = std::max(patient, more_s);
    }
    if (let_go) continue;
    const bool springs = pressed >= kSpringsBack || cell.grip != "NORMAL" || most > kMore;
    const std::uint32_t fine = springs ? kOfSprings : cell.elastic ? kOfReferences : 0u;
    const std::uint32_t limits_m = with.therapist_limits & ~without.therapist_limits,
                        limits_s = with.patient_limits & ~without.patient_limits & ~(cell.elastic ? kOfReferences : 0u);
    EXPECT_EQ(limits_m & ~(springs ? fine : 0u), 0u) << cell.name();
    EXPECT_EQ(limits_s & ~fine, 0u) << cell.name();
    if ((limits_m | limits_s) != 0) ++limited;
    const bool shaken = (with.patient_limits & kLimitShaking) != 0 || (with.therapist_limits & kLimitShaking) != 0;
    // A named loop may be held by a guard.
    EXPECT_TRUE(shaken || most > kMore || without.engaged < 0.99 || with.engaged > 0.99) << cell.name();
  }
  std::printf(
      "%zu sessions: at most %.3f N m more at the therapist, %.3f at the patient; %zu of named loops more; in %zu "
      "a limit acts that did not; %zu of loops that are told to be unstable\n",
      cells.size(), therapist, patient, named, limited, unstable);
}

using Names = std::vector<std::string>;
std::vector<StallCell> cells_of(bool elastic, const std::vector<int>& counts, const Names& hands,
                                const std::vector<int>& lengths_ms, bool random, const Names& grips = {"NORMAL"}) {
  std::vector<StallCell> cells;
  for (const char* architecture : kArchitectures) {
    for (const int per_rev : counts) {
      for (const std::string& hand : hands) {
        for (const std::string& grip : grips) {
          for (const char* side : {"master", "slave"}) {
            for (const int ms : lengths_ms)
              cells.push_back(
                  {architecture, elastic, per_rev, hand, side, ms, random, ms < 40 ? 60 : 100 + 2 * ms, grip});
          }
        }
      }
    }
  }
  return cells;
}

TEST(Gaps, StopsOfAProgramOnDirectDrivesPressNobodyHarder) {
  expect_no_harder(cells_of(false, {4096}, {"", "2"}, {1, 8, 30}, false));
}

TEST(Gaps, StopsOfAProgramPressNobodyHarderWhoeverHoldsTheDevicesHoweverFirmly) {
  expect_no_harder(cells_of(false, {4096}, {"0.5", "20"}, {6, 24}, false, {"LIGHT", "FIRM"}));
}

TEST(Gaps, StopsOfAProgramBeforeAnMcuPressNobodyHarder) {
  expect_no_harder(cells_of(true, {4096}, {"", "2"}, {8, 60}, false));
}

// As it was found: 0.33 N m more at the patient, because a model that waited for calm never learnt the hand.
TEST(Gaps, AHostThatStopsAgainAndAgainStillLearnsWhatIsTouched) {
  for (const char* hand : {"5", "20"}) {
    StallCell cell{"MODEL_MEDIATED", false, 4096, hand, "master", 5, false, 100, "LIGHT"};
    const AtPersons without = persons_of(cell.load(false)), with = persons_of(cell.load());
    EXPECT_LE(with.patient_nm, without.patient_nm + kMore) << cell.name();
    EXPECT_LE(with.therapist_nm, without.therapist_nm + kMore) << cell.name();
  }
}

// The law's own swing and not the stop's: with no stop at all, and the network slower by 5 ms (by 35 without delay),
// they press harder by as much.
TEST(Gaps, LoopsAtTheEndOfTheirStabilityPressAsHardWithoutAStop) {
  struct Swing {
    const char *architecture, *grip, *hand, *delay_s;
  };
  for (const Swing& one : {Swing{"FOUR_CHANNEL", "LIGHT", "20", "0.035"},
                           {"FOUR_CHANNEL_CDOB", "LIGHT", "20", "0.03"},
                           {"FOUR_CHANNEL_CDOB_SDCV", "LIGHT", "20", "0.03"},
                           {"TWO_CHANNEL_PO_PC", "FIRM", "5", "0.03"}}) {
    const StallCell cell{one.architecture, false, 4096, one.hand, "master", 1, false, 60, one.grip};
    const std::string delay = std::string(".delay_s=") + one.delay_s;
    const AtPersons near = persons_of(cell.load(false)),
                    far = persons_of(cell.load(false, {"network.forward" + delay, "network.backward" + delay}));
    const double more = std::max(far.patient_nm - near.patient_nm, far.therapist_nm - near.therapist_nm);
    EXPECT_GT(more, more_of(cell) - 0.005) << cell.name();
  }
}
// As it was found: the therapist felt 0.40 N m in free motion where 0.13 are usual, and the empty orthosis went to the
// end of its range.
TEST(Gaps, AnEmptyOrthosisStaysWithTheTherapistAndHeFeelsNoMore) {
  const std::vector<std::string> far{"network.forward.delay_s=0.1", "network.backward.delay_s=0.1",
                                     "master.therapist.grip=FIRM"};
  for (const char* architecture : {"FOUR_CHANNEL_CDOB", "MODEL_MEDIATED"}) {
    const StallCell cell{architecture, false, 4096, "", "slave", 8, false, 60};
    const AtPersons without = persons_of(cell.load(false, far)), with = persons_of(cell.load(true, far));
    EXPECT_LE(with.therapist_nm, without.therapist_nm + kMore) << cell.name();
    EXPECT_LE(with.reach_rad, without.reach_rad + 0.02) << cell.name();
    EXPECT_EQ(with.patient_limits, without.patient_limits) << cell.name();
  }
}

// What holds a person once a side was silent for longer than the network's timer: a spring.
class Holds final : public Witness {
 public:
  Holds(double from_s, double spring_master, double spring_slave)
      : from_s_(from_s), sides_{{spring_master}, {spring_slave}} {}
  void ticked(bool master, const Side& side, double t_s, OperatorAct) override {
    One& one = sides_[master ? 0 : 1];
    const bool holds = side.trace().state == StationState::kHolding;
    if (holds && one.held_s < 0 && t_s > from_s_) one.held_s = t_s, one.x_hold = side.truth().x;
    one.state = side.trace().state;
    stalled(master, side, t_s);
  }
  void stalled(bool master, const Side& side, double t_s) override {
    One& one = sides_[master ? 0 : 1];
    const Truth truth = side.truth();
    if (t_s > from_s_) one.most_nm = std::max(one.most_nm, std::abs(truth.f));
    if (one.held_s < 0 || t_s < one.held_s + 0.7) return;
    one.beyond_nm = std::max(one.beyond_nm, std::abs(truth.f) - one.spring * std::abs(truth.x - one.x_hold));
  }
  struct One {
    double spring, held_s = -1, x_hold = 0, beyond_nm = -1, most_nm = 0;
    StationState state = StationState::kOff;
  };
  const One& master() const { return sides_[0]; }
  const One& slave() const { return sides_[1]; }

 private:
  double from_s_;
  One sides_[2];
};

void expect_held(const std::vector<int>& lengths_ms) {
  for (const char* architecture : kArchitectures) {
    for (const char* stops : {"master", "slave"}) {
      for (const int ms : lengths_ms) {
        // Once, while the hand is pressed.
        StallCell cell{architecture, false, 20000, "2", stops, ms, false, 100'000};
        LoadedScene loaded = cell.load(true);
        const double from_s = 5.0, way_s = cell.delay_s();
        auto* host = stops == std::string("master") ? loaded.scene.mutable_master()->mutable_host()
                                                    : loaded.scene.mutable_slave()->mutable_host();
        host->set_from_s(from_s);
        loaded.scene.set_duration_s(7);
        const double spring = loaded.scene.control().k_p_per_s2() / loaded.scene.control().k_f_per_kgm2();
        Holds holds(from_s, spring, spring);
        simulate(loaded, make_sides(loaded.scene), holds);
        const AtPersons without = persons_of(cell.load(false));
        const auto name = cell.name();
        const bool master_stops = stops == std::string("master");
        const Holds::One &stopped = master_stops ? holds.master() : holds.slave(),
                         &other = master_stops ? holds.slave() : holds.master();
        EXPECT_EQ(holds.master().state, StationState::kHolding) << name;
        EXPECT_EQ(holds.slave().state, StationState::kHolding) << name;
        // The stopped one in its first tick; the other 100 ms and a tick after the last word of the stopped one came.
        EXPECT_NEAR(stopped.held_s, from_s + 1e-3 * ms, 1.5e-3) << name;
        EXPECT_NEAR(other.held_s, from_s - 1e-3 + way_s + 0.101, 2.5e-3) << name;
        for (const Holds::One& side : {holds.master(), holds.slave()}) EXPECT_LE(side.beyond_nm, kMore) << name;
        EXPECT_LE(holds.master().most_nm, without.therapist_nm + kMore) << name;
        EXPECT_LE(holds.slave().most_nm, without.patient_nm + kMore) << name;
      }
    }
  }
}

TEST(Gaps, AfterStopsOfOverATenthOfASecondBothSidesAreSoftSprings) { expect_held({120, 200}); }

TEST(NightlyGaps, AfterStopsOfOverATenthOfASecondBothSidesAreSoftSprings) { expect_held({105, 140, 160, 180}); }

const Names kHands{"", "0.5", "2", "5", "20"}, kGrips{"LIGHT", "NORMAL", "FIRM"};
const std::vector<int> kLengths{1, 2, 3, 4, 6, 8, 12, 16, 24, 30, 45, 60, 75, 90};

TEST(NightlyGaps, StopsOfAnyLengthOnDirectDrivesPressNobodyHarder) {
  expect_no_harder(cells_of(false, {4096, 20000}, kHands, kLengths, false, kGrips));
}

TEST(NightlyGaps, RandomStopsOnDirectDrivesPressNobodyHarder) {
  expect_no_harder(cells_of(false, {4096, 20000}, kHands, kLengths, true, kGrips));
}

TEST(NightlyGaps, StopsOfAnyLengthBeforeAnMcuPressNobodyHarder) {
  expect_no_harder(cells_of(true, {4096, 20000}, kHands, kLengths, false, kGrips));
}

TEST(NightlyGaps, RandomStopsBeforeAnMcuPressNobodyHarder) {
  expect_no_harder(cells_of(true, {4096, 20000}, kHands, kLengths, true, kGrips));
}

}  // namespace
}  // namespace farhand
