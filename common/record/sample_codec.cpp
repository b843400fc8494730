#include "common/record/sample_codec.hpp"

#include <algorithm>
#include <cmath>

#include "common/record/columns.hpp"

namespace farhand {
namespace {

template <class Columns, class Struct, class Message>
void write(const Columns& columns, const Struct& from, Message& to) {
  for (const auto& column : columns) {
    const auto value = from.*column.member;
    if (column.has == nullptr || !std::isnan(static_cast<double>(value))) (to.*column.set)(value);
  }
}

template <class Columns, class Message, class Struct>
void read(const Columns& columns, const Message& from, Struct& to) {
  for (const auto& column : columns) {
    if (column.has == nullptr || (from.*column.has)()) {
      to.*column.member = (from.*column.get)();
    } else {
      to.*column.member = std::numeric_limits<std::decay_t<decltype(to.*column.member)>>::quiet_NaN();
    }
  }
}

// As it may stand at the head of a column: a file may come from anywhere.
bool is_name(const std::string& text) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  return !text.empty() && text.size() <= 40 && text.find_first_not_of(kLetters) == std::string::npos &&
         std::ranges::find(kStationColumns, text, &decltype(kStationColumns)::value_type::name) ==
             kStationColumns.end();
}

}  // namespace

void encode(Nanoseconds t, const StationSample& sample, record::StationSample& message) {
  message.Clear();
  message.set_t_ns(t);
  message.set_state(static_cast<std::uint32_t>(sample.state));
  write(kStationColumns, sample, message);
  message.set_limits(sample.limits);
  message.set_newest_peer_send_ns(sample.newest_peer_send_ns);
  message.set_newest_peer_arrival_ns(sample.newest_peer_arrival_ns);
  auto last = sample.law.size();
  while (last > 0 && std::isnan(sample.law[last - 1])) --last;
  for (std::size_t i = 0; i < last; ++i) message.add_law(sample.law[i]);
}

void encode(Nanoseconds t, const LinkSample& sample, record::LinkSample& message) {
  message.set_t_ns(t);
  message.set_forward(sample.forward);
  message.set_lost(sample.lost);
  write(kLinkColumns, sample, message);
}

void encode(Nanoseconds t, const McuSample& sample, record::McuSample& message) {
  message.set_t_ns(t);
  message.set_mcu_state(static_cast<std::uint32_t>(sample.state));
  write(kMcuColumns, sample, message);
}

void encode(const StationCounters& counters, record::Counters& message) { write(kCounterColumns, counters, message); }

void encode(const DeviceFriction& friction, record::RunInfo& info) {
  if (std::isnan(friction.threshold_nm)) return;
  record::DeviceFriction& message = *info.mutable_friction();
  message.Clear();
  message.set_threshold_nm(friction.threshold_nm);
  message.set_measured(friction.measured);
  if (std::isnan(friction.F_c_nm)) return;
  message.set_f_c_nm(friction.F_c_nm);
  message.set_spread_nm(friction.spread_nm);
  message.set_swept_utc_s(friction.swept_utc_s);
}

DeviceFriction friction_of(const record::RunInfo& info) {
  DeviceFriction friction;
  if (!info.has_friction()) return friction;
  const record::DeviceFriction& message = info.friction();
  friction.threshold_nm = message.threshold_nm();
  friction.measured = message.measured();
  if (message.has_f_c_nm()) friction.F_c_nm = message.f_c_nm();
  if (message.has_spread_nm()) friction.spread_nm = message.spread_nm();
  friction.swept_utc_s = message.swept_utc_s();
  return friction;
}

StationSample decode(const record::StationSample& message) {
  StationSample sample;
  sample.state = static_cast<int>(message.state());
  read(kStationColumns, message, sample);
  sample.limits = message.limits();
  sample.newest_peer_send_ns = message.newest_peer_send_ns();
  sample.newest_peer_arrival_ns = message.newest_peer_arrival_ns();
  const int signals = std::min(message.law_size(), static_cast<int>(sample.law.size()));
  for (int i = 0; i < signals; ++i) sample.law[static_cast<std::size_t>(i)] = message.law(i);
  // As kUnnamedSignals has them.
  if (message.has_energy_j()) sample.law[0] = message.energy_j();
  if (message.has_friction_nm()) sample.law[1] = message.friction_nm();
  if (message.has_f_2_nm()) sample.law[2] = message.f_2_nm();
  return sample;
}

LinkSample decode(const record::LinkSample& message) {
  LinkSample sample;
  sample.forward = message.forward();
  sample.lost = message.lost();
  read(kLinkColumns, message, sample);
  return sample;
}

McuSample decode(const record::McuSample& message) {
  McuSample sample;
  sample.state = static_cast<int>(message.mcu_state());
  read(kMcuColumns, message, sample);
  return sample;
}

StationCounters decode(const record::Counters& message) {
  StationCounters counters;
  read(kCounterColumns, message, counters);
  return counters;
}

std::vector<std::string> signals_of(const record::RunInfo& info, bool master) {
  if (!info.signals_named()) return {kUnnamedSignals.begin(), kUnnamedSignals.end()};
  std::vector<std::string> names;
  for (const std::string& name : master ? info.master_signals() : info.slave_signals()) {
    if (names.size() == kMostLawSignals) break;
    names.push_back(is_name(name) ? name : "signal_" + std::to_string(names.size() + 1));
  }
  return names;
}

void name_signals(const std::vector<std::string>& master, const std::vector<std::string>& slave,
                  record::RunInfo& info) {
  info.set_signals_named(true);
  info.mutable_master_signals()->Assign(master.begin(), master.end());
  info.mutable_slave_signals()->Assign(slave.begin(), slave.end());
}

}  // namespace farhand
