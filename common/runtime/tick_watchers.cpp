#include "common/runtime/tick_watchers.hpp"

#include <limits>

#include "common/record/sample.hpp"

namespace farhand {

void RecordingWatcher::ticked(const StationTick& tick) noexcept {
  const Side& side = tick.side;
  recorder_.push(tick.time.deadline_ns, sample_of(side.trace(), side.receiver(), side.truth(), tick.t_s));
  journal_.step(tick.t_s, side.trace(), tick.asked.act, tick.asked.said, why_of(side),
                [&](std::string_view sentence) { recorder_.note(tick.time.deadline_ns, sentence); });
  const std::string_view harder = tendons_.step(side.trace(), side.receiver().newest());
  if (!harder.empty()) recorder_.note(tick.time.deadline_ns, harder);
}

void StatusWatcher::ticked(const StationTick& tick) noexcept {
  const auto& trace = tick.side.trace();
  const ReceiverCounters& counters = tick.side.receiver().counters();
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  LiveStatus s;
  s.t_s = tick.t_s;
  s.state = trace.state;
  s.x_m_rad = leads_ ? trace.local.x[0] : trace.remote.x[0];
  s.x_s_rad = leads_ ? trace.remote.x[0] : trace.local.x[0];
  s.f_m_nm = leads_ ? trace.local.f[0] : trace.remote.f[0];
  s.f_s_nm = leads_ ? trace.remote.f[0] : trace.local.f[0];
  s.rtt_s = trace.rtt > 0 ? to_seconds(trace.rtt) : unknown;
  const double expected = static_cast<double>(counters.received + counters.lost);
  s.loss_share = expected > 0 ? static_cast<double>(counters.lost) / expected : unknown;
  const std::uint32_t peer_limits = tick.side.receiver().newest().limits;
  s.waits = trace.waits;
  s.resumed = trace.resumed;
  s.therapist_limits = leads_ ? trace.limits : peer_limits;
  s.patient_limits = leads_ ? peer_limits : trace.limits;
  s.dropped = dropped(tick.totals);
  s.unsent = tick.totals.send_failed;
  s.cut = tick.totals.cut_ticks;
  const SerialCounters serial = tick.side.serial_counters();
  s.line_s = serial.age_s > 0 ? serial.age_s : unknown;
  s.line_lags = serial.warns;
  s.line_blind = serial.blind;
  s.line_slow = trace.reason == Reason::kLineSlow;
  tendons_.step(trace, tick.side.receiver().newest());
  s.tendons_harder = tendons_.harder();
  printer_.show(s);
}

std::uint64_t dropped(const StationCounters& c) noexcept {
  return c.duplicate + c.rejected_checksum + c.rejected_format + c.rejected_session + c.rejected_expired +
         c.rejected_not_finite + c.rejected_foreign + c.dropped_too_long + c.dropped_by_kernel + c.dropped_handshake;
}

}  // namespace farhand
