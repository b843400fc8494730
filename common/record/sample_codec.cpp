#include "common/record/sample_codec.hpp"

#include <cmath>
#include <limits>

namespace farhand {

void encode(Nanoseconds t, const StationSample& sample, record::StationSample& message) {
  message.Clear();
  message.set_t_ns(t);
  message.set_state(static_cast<std::uint32_t>(sample.state));
  message.set_x_rad(sample.x_rad);
  message.set_v_rad_s(sample.v_rad_s);
  message.set_f_nm(sample.f_nm);
  message.set_remote_x_rad(sample.remote_x_rad);
  message.set_remote_v_rad_s(sample.remote_v_rad_s);
  message.set_remote_f_nm(sample.remote_f_nm);
  message.set_target_x_rad(sample.target_x_rad);
  message.set_command_nm(sample.command_nm);
  message.set_x_cdob_rad(sample.x_cdob_rad);
  message.set_alpha(sample.alpha);
  message.set_playout_delay_s(sample.playout_delay_s);
  message.set_rtt_s(sample.rtt_s);
  message.set_limits(sample.limits);
  message.set_newest_peer_send_ns(sample.newest_peer_send_ns);
  message.set_newest_peer_arrival_ns(sample.newest_peer_arrival_ns);
  if (!std::isnan(sample.energy_j)) message.set_energy_j(sample.energy_j);
  if (!std::isnan(sample.friction_nm)) message.set_friction_nm(sample.friction_nm);
  if (!std::isnan(sample.f_2_nm)) message.set_f_2_nm(sample.f_2_nm);
  if (!std::isnan(sample.true_x_rad)) message.set_true_x_rad(sample.true_x_rad);
  if (!std::isnan(sample.true_v_rad_s)) message.set_true_v_rad_s(sample.true_v_rad_s);
  if (!std::isnan(sample.true_f_nm)) message.set_true_f_nm(sample.true_f_nm);
}

void encode(Nanoseconds t, const LinkSample& sample, record::LinkSample& message) {
  message.set_t_ns(t);
  message.set_forward(sample.forward);
  message.set_lost(sample.lost);
  message.set_asked_delay_s(sample.asked_delay_s);
  message.set_achieved_delay_s(sample.achieved_delay_s);
}

void encode(Nanoseconds t, const McuSample& sample, record::McuSample& message) {
  message.set_t_ns(t);
  message.set_true_x_rad(sample.true_x_rad);
  message.set_true_v_rad_s(sample.true_v_rad_s);
  message.set_true_f_nm(sample.true_f_nm);
  message.set_motor_x_rad(sample.motor_x_rad);
  message.set_spring_torque_nm(sample.spring_torque_nm);
  message.set_torque_command_nm(sample.torque_command_nm);
  message.set_mcu_state(static_cast<std::uint32_t>(sample.state));
}

void encode(const StationCounters& counters, record::Counters& message) {
  message.set_ticks(counters.ticks);
  message.set_overruns(counters.overruns);
  message.set_missed_ticks(counters.missed_ticks);
  message.set_sent(counters.sent);
  message.set_received(counters.received);
  message.set_late(counters.late);
  message.set_reordered(counters.reordered);
  message.set_duplicate(counters.duplicate);
  message.set_lost(counters.lost);
  message.set_rejected_checksum(counters.rejected_checksum);
  message.set_rejected_format(counters.rejected_format);
  message.set_rejected_session(counters.rejected_session);
  message.set_rejected_expired(counters.rejected_expired);
  message.set_rejected_not_finite(counters.rejected_not_finite);
  message.set_serial_crc_errors(counters.serial_crc_errors);
  message.set_serial_sent(counters.serial_sent);
  message.set_serial_received(counters.serial_received);
  message.set_serial_need_us(counters.serial_need_us);
  message.set_serial_most_us(counters.serial_most_us);
  message.set_serial_warned(counters.serial_warned);
  message.set_serial_sagged(counters.serial_sagged);
  message.set_cut_ticks(counters.cut_ticks);
  message.set_record_overflow(counters.record_overflow);
  message.set_record_unwritten(counters.record_unwritten);
  message.set_rejected_foreign(counters.rejected_foreign);
  message.set_dropped_too_long(counters.dropped_too_long);
  message.set_dropped_by_kernel(counters.dropped_by_kernel);
  message.set_dropped_handshake(counters.dropped_handshake);
  message.set_send_failed(counters.send_failed);
}

StationSample decode(const record::StationSample& message) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  StationSample sample;
  sample.state = static_cast<int>(message.state());
  sample.x_rad = message.x_rad();
  sample.v_rad_s = message.v_rad_s();
  sample.f_nm = message.f_nm();
  sample.remote_x_rad = message.remote_x_rad();
  sample.remote_v_rad_s = message.remote_v_rad_s();
  sample.remote_f_nm = message.remote_f_nm();
  sample.target_x_rad = message.target_x_rad();
  sample.command_nm = message.command_nm();
  sample.x_cdob_rad = message.x_cdob_rad();
  sample.alpha = message.alpha();
  sample.playout_delay_s = message.playout_delay_s();
  sample.rtt_s = message.rtt_s();
  sample.limits = message.limits();
  sample.newest_peer_send_ns = message.newest_peer_send_ns();
  sample.newest_peer_arrival_ns = message.newest_peer_arrival_ns();
  sample.energy_j = message.has_energy_j() ? message.energy_j() : kUnknown;
  sample.friction_nm = message.has_friction_nm() ? message.friction_nm() : kUnknown;
  sample.f_2_nm = message.has_f_2_nm() ? message.f_2_nm() : kUnknown;
  sample.true_x_rad = message.has_true_x_rad() ? message.true_x_rad() : kUnknown;
  sample.true_v_rad_s = message.has_true_v_rad_s() ? message.true_v_rad_s() : kUnknown;
  sample.true_f_nm = message.has_true_f_nm() ? message.true_f_nm() : kUnknown;
  return sample;
}

LinkSample decode(const record::LinkSample& message) {
  LinkSample sample;
  sample.forward = message.forward();
  sample.lost = message.lost();
  sample.asked_delay_s = message.asked_delay_s();
  sample.achieved_delay_s = message.achieved_delay_s();
  return sample;
}

McuSample decode(const record::McuSample& message) {
  McuSample sample;
  sample.true_x_rad = message.true_x_rad();
  sample.true_v_rad_s = message.true_v_rad_s();
  sample.true_f_nm = message.true_f_nm();
  sample.motor_x_rad = message.motor_x_rad();
  sample.spring_torque_nm = message.spring_torque_nm();
  sample.torque_command_nm = message.torque_command_nm();
  sample.state = static_cast<int>(message.mcu_state());
  return sample;
}

StationCounters decode(const record::Counters& message) {
  StationCounters counters;
  counters.ticks = message.ticks();
  counters.overruns = message.overruns();
  counters.missed_ticks = message.missed_ticks();
  counters.sent = message.sent();
  counters.received = message.received();
  counters.late = message.late();
  counters.reordered = message.reordered();
  counters.duplicate = message.duplicate();
  counters.lost = message.lost();
  counters.rejected_checksum = message.rejected_checksum();
  counters.rejected_format = message.rejected_format();
  counters.rejected_session = message.rejected_session();
  counters.rejected_expired = message.rejected_expired();
  counters.rejected_not_finite = message.rejected_not_finite();
  counters.serial_crc_errors = message.serial_crc_errors();
  counters.serial_sent = message.serial_sent();
  counters.serial_received = message.serial_received();
  counters.serial_need_us = message.serial_need_us();
  counters.serial_most_us = message.serial_most_us();
  counters.serial_warned = message.serial_warned();
  counters.serial_sagged = message.serial_sagged();
  counters.cut_ticks = message.cut_ticks();
  counters.record_overflow = message.record_overflow();
  counters.record_unwritten = message.record_unwritten();
  counters.rejected_foreign = message.rejected_foreign();
  counters.dropped_too_long = message.dropped_too_long();
  counters.dropped_by_kernel = message.dropped_by_kernel();
  counters.dropped_handshake = message.dropped_handshake();
  counters.send_failed = message.send_failed();
  return counters;
}

}  // namespace farhand
