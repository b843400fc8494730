#include "common/record/merge.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "common/files/output.hpp"
#include "common/record/stamps.hpp"

namespace farhand {
namespace {

constexpr Nanoseconds kNever = std::numeric_limits<Nanoseconds>::max();

Nanoseconds fastest_transit(const Recorded::Series<StationSample>& arrivals) {
  Nanoseconds fastest = kNever;
  for (const auto& [t, sample] : arrivals) {
    if (sample.newest_peer_arrival_ns == 0) continue;
    fastest = std::min(fastest, stamp_difference(sample.newest_peer_arrival_ns, sample.newest_peer_send_ns));
  }
  return fastest;
}

double fastest_round_trip(const Recorded::Series<StationSample>& samples) {
  double fastest = std::numeric_limits<double>::infinity();
  for (const auto& [t, sample] : samples) {
    if (sample.rtt_s > 0) fastest = std::min(fastest, sample.rtt_s);
  }
  return fastest;
}

// The emulator ticks at its own pace: its world is read between its ticks.
void add_true_world(const Recorded::Series<McuSample>& mcu, Recorded::Series<StationSample>& slave) {
  auto after = mcu.begin();
  for (auto& [t, sample] : slave) {
    while (after != mcu.end() && after->first < t) ++after;
    if (after == mcu.end() || (after == mcu.begin() && after->first != t)) continue;  // outside: stays unknown
    const auto before = after == mcu.begin() ? after : after - 1;
    const Nanoseconds span = stamp_difference(after->first, before->first);
    const double part =
        span > 0 ? static_cast<double>(stamp_difference(t, before->first)) / static_cast<double>(span) : 1;
    const auto between = [&](double McuSample::*field) {
      return before->second.*field + part * (after->second.*field - before->second.*field);
    };
    sample.true_x_rad = between(&McuSample::true_x_rad);
    sample.true_v_rad_s = between(&McuSample::true_v_rad_s);
    sample.true_f_nm = between(&McuSample::true_f_nm);
  }
}

bool knows_true_world(const Recorded::Series<StationSample>& samples) {
  return std::any_of(samples.begin(), samples.end(),
                     [](const auto& timed) { return !std::isnan(timed.second.true_x_rad); });
}

// The recordings of a role in the order of their numbers; where one was completed, not its .part.
std::vector<std::filesystem::path> recordings_of(const std::string& role, const std::filesystem::path& directory) {
  std::map<int, std::filesystem::path> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
    std::string name = entry.path().filename().string();
    const bool unfinished = name.ends_with(".part");
    if (unfinished) name.resize(name.size() - 5);
    int number = 1;
    if (name != role + ".mcap") {
      if (!name.starts_with(role + "-")) continue;
      const char* digits = name.data() + role.size() + 1;
      const auto [rest, wrong] = std::from_chars(digits, name.data() + name.size(), number);
      if (wrong != std::errc() || number < 2 || name != numbered(role + ".mcap", number)) continue;
    }
    const auto [known, is_new] = found.try_emplace(number, entry.path());
    if (!is_new && !unfinished) known->second = entry.path();
  }
  std::vector<std::filesystem::path> files;
  for (const auto& [number, file] : found) files.push_back(file);
  return files;
}

std::string milliseconds(double s) { return std::to_string(s * 1e3) + " ms"; }

}  // namespace

ClockOffset estimate_clock_offset(const Recorded::Series<StationSample>& master,
                                  const Recorded::Series<StationSample>& slave) {
  const Nanoseconds forward = fastest_transit(slave), back = fastest_transit(master);
  if (forward == kNever || back == kNever) return {0, std::numeric_limits<double>::infinity()};
  // Halved before the sum: the offset of two hosts' clocks may be large.
  const double offset = to_seconds(back) / 2 - to_seconds(forward) / 2;
  const double half_width = to_seconds(stamp_sum(forward, back)) / 2;
  if (half_width >= 0) return {offset, half_width};
  const double round_trip = std::min(fastest_round_trip(master), fastest_round_trip(slave));
  return {offset, round_trip / 2 - half_width, false};
}

Session merge_recordings(const std::filesystem::path& directory) {
  Session session;
  const auto remark = [&](const std::string& who, const std::string& text) {
    session.events.push_back({0, who, text});
  };
  const auto load = [&](const std::string& role) -> std::optional<Recorded> {
    const std::vector<std::filesystem::path> files = recordings_of(role, directory);
    if (files.empty()) return std::nullopt;
    const std::filesystem::path& file = files.back();
    if (files.size() > 1) {
      remark(role, file.filename().string() + " was read, the newest of " + std::to_string(files.size()) +
                       " recordings of this side; the one before it is " + files[files.size() - 2].filename().string());
    }
    try {
      Recorded recorded = read_recording(file);
      for (const std::string& problem : recorded.problems) remark(role, "recording " + problem);
      return recorded;
    } catch (const std::runtime_error& error) {
      remark(role, error.what());
      return std::nullopt;
    }
  };
  std::optional<Recorded> master = load("master"), slave = load("slave");
  const std::optional<Recorded> netem = load("netem"), mcu = load("mcu");
  if (!master && !slave) {
    throw std::runtime_error(directory.string() + " holds no readable recording of a master or a slave" +
                             (session.events.empty() ? "" : ": " + session.events.front().text));
  }
  for (const auto& [recorded, role] : {std::pair{&master, "master"}, std::pair{&slave, "slave"}}) {
    if (!*recorded) remark(role, "there is no recording of this side");
  }

  const record::RunInfo& run = (master ? *master : *slave).info;
  session.scene_name = run.scene_name();
  session.scene_text = run.scene_text();
  session.seed = run.seed();
  session.deterministic = run.deterministic();
  if (master) session.master_signals = signals_of(master->info, true);
  if (slave) session.slave_signals = signals_of(slave->info, false);

  // The emulator shares the slave's host, so its stamps are the slave's clock.
  if (mcu && slave && !knows_true_world(slave->slave)) add_true_world(mcu->mcu, slave->slave);

  Nanoseconds shift = 0;  // slave's clock to master's, in integers: both clocks may be large
  if (master && slave) {
    const std::string& clock = master->info.clock_id();
    if (clock.empty() || clock != slave->info.clock_id()) {
      const ClockOffset clocks = estimate_clock_offset(master->master, slave->slave);
      const bool one_way = std::isinf(clocks.bound_s) && clocks.one_rate;
      // Without packets in both directions there is nothing better than what the hosts believe to be the time of day.
      const auto of_day = [](const record::RunInfo& info) {
        return stamp_difference(info.start_utc_ns(), info.start_ns());
      };
      shift =
          one_way ? stamp_difference(of_day(master->info), of_day(slave->info)) : stamp_from_seconds(clocks.offset_s);
      session.clock_offset_s = to_seconds(shift);
      session.clock_offset_bound_s = clocks.bound_s;
      remark("slave", one_way ? "packets did not pass in both directions: clocks are aligned by the time of day"
                              : "clock aligned to the master's within +- " + milliseconds(clocks.bound_s));
      if (!clocks.one_rate) remark("slave", "the clocks drifted apart during the run: one offset does not fit it all");
    }
  }

  const Nanoseconds start = run.start_ns();
  const auto on_axis = [start](Nanoseconds t, Nanoseconds to_master) {
    return to_seconds(stamp_difference(stamp_sum(t, to_master), start));
  };
  const auto place = [&](auto& series, Nanoseconds to_master, auto& into) {
    into.reserve(series.size());
    for (const auto& [t, sample] : series) into.emplace_back(sample).t_s = on_axis(t, to_master);
  };
  const auto add_events = [&](const Recorded& recorded, Nanoseconds to_master) {
    for (const record::Event& event : recorded.events) {
      session.events.push_back({on_axis(event.t_ns(), to_master), event.who(), event.text()});
    }
  };
  const auto counters = [](const Recorded& recorded) {
    return recorded.info.counters_size() > 0 ? decode(recorded.info.counters(0)) : StationCounters{};
  };
  if (master) {
    place(master->master, 0, session.master);
    add_events(*master, 0);
    session.master_counters = counters(*master);
  }
  if (slave) {
    place(slave->slave, shift, session.slave);
    add_events(*slave, shift);
    session.slave_counters = counters(*slave);
    session.friction = friction_of(slave->info);
  }
  if (netem) {  // netem stands beside the master: a third clock is not aligned
    place(netem->link, 0, session.link);
    add_events(*netem, 0);
  }
  if (mcu) add_events(*mcu, shift);
  std::stable_sort(session.events.begin(), session.events.end(),
                   [](const SessionEvent& a, const SessionEvent& b) { return a.t_s < b.t_s; });
  return session;
}

}  // namespace farhand
