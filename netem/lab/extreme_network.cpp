// What a network and foreign clocks can do: delays, jitter, loss, packets that are reordered, doubled or damaged, and
// clocks that are set while everything runs.
#include <algorithm>

#include "netem/lab/extreme_families.hpp"

namespace farhand::extreme {
namespace {

constexpr double kStatics = 2e-6;  // rad, what is left of the transients at the end of a run

// Same numbers everywhere.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
  }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

Sets with(Sets sets, const Sets& more) {
  sets.insert(sets.end(), more.begin(), more.end());
  return sets;
}

Sets delay(const std::string& seconds) { return both_ways({"delay_s=" + seconds, "distribution=CONSTANT"}); }

void add_delays(Cases& cases) {
  const auto plain = [&](const std::string& s, const std::string& duration, double within) {
    cases.push_back(session_case("delays", "plain four channels over " + s + " s each way", accurate(within),
                                 with(delay(s), {"duration_s=" + duration})));
  };
  plain("0", "7", kStatics);
  plain("0.01", "7", kStatics);
  plain("0.05", "10", kStatics);
  plain("0.1", "14", kStatics);
  plain("0.2", "20", kStatics);
  const auto cdob = [&](const std::string& s, const std::string& duration) {
    cases.push_back(session_case("delays", "CDOB over " + s + " s each way", accurate(kStatics),
                                 with(delay(s), {"duration_s=" + duration, "architecture=FOUR_CHANNEL_CDOB"})));
  };
  cdob("0.05", "10");
  cdob("0.1", "14");
  cases.push_back(session_case("delays", "5 s each way, engagement given up after 5 s",
                               refused("master holding: timeout"),
                               with(delay("5"), {"duration_s=40", "operator_acts[0].at_s=8"})));
}

void add_jitter(Cases& cases) {
  const auto normal = [&](const std::string& d, const std::string& j, Sets more = {}) {
    cases.push_back(session_case(
        "jitter larger than the delay", "normal, delay " + d + " s, deviation " + j + " s", accurate(kStatics),
        with(with(both_ways({"delay_s=" + d, "jitter_s=" + j, "distribution=NORMAL_DISTRIBUTION"}), {"duration_s=14"}),
             more)));
  };
  normal("0", "0.005");
  normal("0.005", "0.01");
  normal("0.01", "0.05");
  normal("0.001", "0.1", {"duration_s=30"});
  cases.push_back(session_case("jitter larger than the delay", "uniform, delay 10 ms +- 20 ms",
                               refused("no packet arrives before it is sent"),
                               both_ways({"delay_s=0.01", "jitter_s=0.02", "distribution=UNIFORM"})));
}

void add_loss(Cases& cases) {
  for (const char* loss : {"0", "0.01", "0.1", "0.3", "0.5", "0.8", "0.9"}) {
    cases.push_back(session_case("loss", std::string("share ") + loss + " each way", accurate(kStatics),
                                 with(both_ways({std::string("loss=") + loss}), {"duration_s=9"})));
  }
  cases.push_back(session_case("loss", "share 0.99 each way: longer silent than 100 ms now and then",
                               refused("holding: peer"), with(both_ways({"loss=0.99"}), {"duration_s=9"})));
  cases.push_back(session_case("loss", "share 1 each way", refused("master ready: tested"), both_ways({"loss=1"})));
  cases.push_back(session_case("loss", "share 1 to the slave only", refused("master holding: timeout"),
                               {"network.forward.loss=1"}));
}

// What a tamperer did, to be compared with what the receivers counted. Statics must hold all the same.
struct Tally {
  std::uint64_t duplicated = 0, damaged = 0, held_back = 0;
};
using Tamperer = std::function<std::vector<Letter>(const Letter&, Dice&, Tally&)>;

Case tampered(std::string name, Expected expected, Tamperer tamper,
              std::function<std::string(const Tally&, const SessionRecord&)> wrong) {
  const auto run = [=] {
    Tally tally;
    Dice dice(17);
    SessionPlan plan;
    plan.sets = with(delay("0.02"), {"duration_s=9"});
    plan.to_slave = plan.to_master = [&](const Letter& letter) { return tamper(letter, dice, tally); };
    const SessionRecord record = run_session(plan);
    Outcome out = judge_session(record);
    out.second_way = "statics, and counts of the tamperer";
    const std::string complaint = wrong(tally, record);
    if (!complaint.empty()) out.error = Outcome::kNan;
    out.what +=
        "; " + (complaint.empty() ? std::to_string(tally.duplicated) + " doubled, " + std::to_string(tally.damaged) +
                                        " damaged, " + std::to_string(tally.held_back) + " held back"
                                  : complaint);
    return out;
  };
  return {"packets out of order, doubled, damaged", std::move(name), std::move(expected), run};
}

std::uint64_t rejected(const SideRecord& side) {
  std::uint64_t sum = 0;
  for (std::size_t k = 1; k < kDecodeResults; ++k) sum += side.decoded[k];
  return sum;
}

std::string none_wrong(const Tally&, const SessionRecord&) { return {}; }
std::string duplicates_counted(const Tally& tally, const SessionRecord& r) {
  // A copy of what was late already counts as late; the last copies may still fly.
  const std::uint64_t seen =
      r.master.received.duplicate + r.slave.received.duplicate + r.master.received.late + r.slave.received.late;
  return seen + 200 >= tally.duplicated
             ? ""
             : "only " + std::to_string(seen) + " of " + std::to_string(tally.duplicated) + " copies were found";
}
std::string damage_counted(const Tally& tally, const SessionRecord& r) {
  const std::uint64_t found = rejected(r.master) + rejected(r.slave);
  return found <= tally.damaged && found + 200 >= tally.damaged
             ? ""
             : std::to_string(found) + " of " + std::to_string(tally.damaged) + " damaged letters were found";
}

void add_packets(Cases& cases) {
  cases.push_back(tampered(
      "every letter twice", accurate(kStatics),
      [](const Letter& letter, Dice&, Tally& tally) {
        ++tally.duplicated;
        return std::vector<Letter>{letter, letter};
      },
      duplicates_counted));
  cases.push_back(tampered(
      "every letter three times, the copies 5 and 50 ms later", accurate(kStatics),
      [](const Letter& letter, Dice&, Tally& tally) {
        tally.duplicated += 2;
        Letter second = letter, third = letter;
        second.due += 5 * kMillisecond;
        third.due += 50 * kMillisecond;
        return std::vector<Letter>{letter, second, third};
      },
      duplicates_counted));
  cases.push_back(tampered(
      "every second letter 7 ms late: out of order all the time", accurate(kStatics),
      [](const Letter& letter, Dice& dice, Tally& tally) {
        Letter later = letter;
        if (dice.next() % 2 == 0) later.due += 7 * kMillisecond, ++tally.held_back;
        return std::vector<Letter>{later};
      },
      none_wrong));
  cases.push_back(tampered(
      "one in a thousand 1.5 s late", accurate(kStatics),
      [](const Letter& letter, Dice& dice, Tally& tally) {
        Letter later = letter;
        if (dice.next() % 1000 == 0) later.due += 1500 * kMillisecond, ++tally.held_back;
        return std::vector<Letter>{later};
      },
      none_wrong));
  cases.push_back(tampered(
      "one bit in every third letter is flipped", accurate(kStatics),
      [](const Letter& letter, Dice& dice, Tally& tally) {
        Letter damaged = letter;
        if (dice.next() % 3 == 0) {
          const std::uint64_t bit = dice.next() % (8 * damaged.bytes.size());
          damaged.bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
          ++tally.damaged;
        }
        return std::vector<Letter>{damaged};
      },
      damage_counted));
  cases.push_back(tampered(
      "a third is replaced by noise of the same length", accurate(kStatics),
      [](const Letter& letter, Dice& dice, Tally& tally) {
        Letter damaged = letter;
        if (dice.next() % 3 == 0) {
          for (std::byte& byte : damaged.bytes) byte = static_cast<std::byte>(dice.next());
          ++tally.damaged;
        }
        return std::vector<Letter>{damaged};
      },
      damage_counted));
  cases.push_back(tampered(
      "every letter is damaged", refused("master ready: tested"),
      [](const Letter& letter, Dice& dice, Tally& tally) {
        Letter damaged = letter;
        const std::uint64_t bit = dice.next() % (8 * damaged.bytes.size());
        damaged.bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
        ++tally.damaged;
        return std::vector<Letter>{damaged};
      },
      damage_counted));
}

void add_clocks(Cases& cases) {
  const std::string family = "a clock that steps";
  for (const char* offset : {"1e9", "-1e9"}) {
    cases.push_back(session_case(family, std::string("the slave's clock is off by ") + offset + " s",
                                 accurate(kStatics), {std::string("network.peer_clock_offset_s=") + offset}));
  }
  for (const char* skew : {"1000", "-1000"}) {
    cases.push_back(session_case(family, std::string("the slave's clock runs by ") + skew + " ppm", accurate(kStatics),
                                 {std::string("network.peer_clock_skew_ppm=") + skew, "duration_s=9"}));
  }
  const auto step = [&](const std::string& name, Nanoseconds by, Expected expected) {
    SessionPlan plan;
    plan.sets = with(delay("0.02"), {"duration_s=14"});
    plan.slave_clock = [by](Nanoseconds t) { return 100 * kSecond + (t < 5 * kSecond ? t : t + by); };
    cases.push_back(session_case(family, "set " + name + " at 5 s", std::move(expected), std::move(plan)));
  };
  step("1 ms ahead", kMillisecond, accurate(kStatics));
  step("1 ms back", -kMillisecond, accurate(kStatics));
  step("50 ms ahead", 50 * kMillisecond, accurate(kStatics));
  step("50 ms back", -50 * kMillisecond, accurate(kStatics));
  // That it was set cannot be told from having slept: what came meanwhile is not acted on.
  step("1 s ahead", kSecond, refused("slave holding: peer silent"));
  // What is stamped an hour or a second before what came last cannot be told from a replay: both sides hold.
  step("1 s back", -kSecond, refused("master holding: peer silent"));
  step("an hour ahead", 3600 * kSecond, refused("slave holding: peer silent"));
  step("an hour back", -3600 * kSecond, refused("master holding: peer silent"));
}

}  // namespace

void add_network(Cases& cases) {
  add_delays(cases);
  add_jitter(cases);
  add_loss(cases);
  add_packets(cases);
  add_clocks(cases);
}

}  // namespace farhand::extreme
