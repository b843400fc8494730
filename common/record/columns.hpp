// The table of recorded quantities, one row each: name in files, meaning, member of the struct that a loop fills
// (session.hpp), and field of the message in a file (record.proto). Encoding, decoding, CSV and `farhand-lab schema`
// use this table. The law's own signals follow under the names of the architecture (StationSample::law).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/record/session.hpp"
#include "proto/record.pb.h"

namespace farhand {

template <class Struct, class Message, class Value>
struct Column {
  std::string_view name;  // of a quantity: ends in its unit
  std::string_view unit;
  std::string_view meaning;
  Value Struct::*member;
  Value (Message::*get)() const;
  void (Message::*set)(Value);
  bool (Message::*has)() const = nullptr;  // if there is one: NaN is absent from the message
};

// Column, member and field have one name.
#define FARHAND_COLUMN(Struct, Message, field, unit, meaning)                                    \
  Column {                                                                                       \
    std::string_view(#field), std::string_view(unit), std::string_view(meaning), &Struct::field, \
        &record::Message::field, &record::Message::set_##field,                                  \
        static_cast<bool (record::Message::*)() const>(nullptr)                                  \
  }
#define FARHAND_COLUMN_OR_NONE(Struct, Message, field, unit, meaning)                            \
  Column {                                                                                       \
    std::string_view(#field), std::string_view(unit), std::string_view(meaning), &Struct::field, \
        &record::Message::field, &record::Message::set_##field, &record::Message::has_##field    \
  }

// Without the state, the limits (LimitBit) and the stamps of the newest packet, which are whole numbers.
inline const std::array kStationColumns{
    FARHAND_COLUMN(StationSample, StationSample, x_rad, "rad", "angle of the own axis"),
    FARHAND_COLUMN(StationSample, StationSample, v_rad_s, "rad/s", "its velocity, as estimated"),
    FARHAND_COLUMN(StationSample, StationSample, f_nm, "N m", "reaction torque on its actuator, as estimated"),
    FARHAND_COLUMN(StationSample, StationSample, remote_x_rad, "rad", "the peer, as played out: angle"),
    FARHAND_COLUMN(StationSample, StationSample, remote_v_rad_s, "rad/s", "velocity"),
    FARHAND_COLUMN(StationSample, StationSample, remote_f_nm, "N m",
                   "reaction torque, or what the architecture sends in its place"),
    FARHAND_COLUMN(StationSample, StationSample, target_x_rad, "rad", "angle to follow, blended"),
    FARHAND_COLUMN(StationSample, StationSample, command_nm, "N m",
                   "torque applied after every limit, or torque reference sent to the MCU"),
    FARHAND_COLUMN(StationSample, StationSample, x_cdob_rad, "rad",
                   "what is followed beyond what was received, by the CDOB or a model; 0 without"),
    FARHAND_COLUMN(StationSample, StationSample, alpha, "1", "of that, what is used; 1 without"),
    FARHAND_COLUMN(StationSample, StationSample, playout_delay_s, "s", "depth of the play-out"),
    FARHAND_COLUMN(StationSample, StationSample, rtt_s, "s", "newest round trip; 0 before one"),
    FARHAND_COLUMN_OR_NONE(StationSample, StationSample, true_x_rad, "rad", "where the world is simulated: true angle"),
    FARHAND_COLUMN_OR_NONE(StationSample, StationSample, true_v_rad_s, "rad/s", "true velocity"),
    FARHAND_COLUMN_OR_NONE(StationSample, StationSample, true_f_nm, "N m",
                           "true torque between device and person, signed as f"),
};

inline const std::array kLinkColumns{
    FARHAND_COLUMN(LinkSample, LinkSample, asked_delay_s, "s", "delay that the link was asked for"),
    FARHAND_COLUMN(LinkSample, LinkSample, achieved_delay_s, "s", "delay that it gave"),
};

inline const std::array kMcuColumns{
    FARHAND_COLUMN(McuSample, McuSample, true_x_rad, "rad", "true angle of the joint"),
    FARHAND_COLUMN(McuSample, McuSample, true_v_rad_s, "rad/s", "true velocity"),
    FARHAND_COLUMN(McuSample, McuSample, true_f_nm, "N m", "true torque between orthosis and hand"),
    FARHAND_COLUMN(McuSample, McuSample, motor_x_rad, "rad", "angle of the motor, seen at the joint"),
    FARHAND_COLUMN(McuSample, McuSample, spring_torque_nm, "N m", "of the spring"),
    FARHAND_COLUMN(McuSample, McuSample, torque_command_nm, "N m", "what the MCU wants of its spring"),
};

inline const std::array kCounterColumns{
    FARHAND_COLUMN(StationCounters, Counters, ticks, "1", "run"),
    FARHAND_COLUMN(StationCounters, Counters, overruns, "1", "longer than a period"),
    FARHAND_COLUMN(StationCounters, Counters, missed_ticks, "1", "skipped"),
    FARHAND_COLUMN(StationCounters, Counters, sent, "1", "packets to the peer"),
    FARHAND_COLUMN(StationCounters, Counters, received, "1", "packets of the peer"),
    FARHAND_COLUMN(StationCounters, Counters, late, "1", "for their turn of play-out"),
    FARHAND_COLUMN(StationCounters, Counters, reordered, "1", "overtaken"),
    FARHAND_COLUMN(StationCounters, Counters, duplicate, "1", "came twice"),
    FARHAND_COLUMN(StationCounters, Counters, lost, "1", "on the way"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_checksum, "1", "damaged, or forged"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_format, "1", "of no format of ours"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_session, "1", "of an older session"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_expired, "1", "older than they may be"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_not_finite, "1", "with a number that is none"),
    FARHAND_COLUMN(StationCounters, Counters, serial_crc_errors, "1", "frames damaged on the line"),
    FARHAND_COLUMN(StationCounters, Counters, serial_sent, "1", "frames to the MCU"),
    FARHAND_COLUMN(StationCounters, Counters, serial_received, "1", "frames of the MCU"),
    FARHAND_COLUMN(StationCounters, Counters, serial_need_us, "us", "a command and its echo, the least"),
    FARHAND_COLUMN(StationCounters, Counters, serial_most_us, "us", "the most"),
    FARHAND_COLUMN(StationCounters, Counters, serial_warned, "1", "echoes that took 10 ms more than the least"),
    FARHAND_COLUMN(StationCounters, Counters, serial_sagged, "1", "times that the MCU let go without a command"),
    FARHAND_COLUMN(StationCounters, Counters, cut_ticks, "1", "in which something that the peer said was cut"),
    FARHAND_COLUMN(StationCounters, Counters, record_overflow, "1", "samples that the ring had no room for"),
    FARHAND_COLUMN(StationCounters, Counters, record_unwritten, "1", "samples that the disk did not take"),
    FARHAND_COLUMN(StationCounters, Counters, rejected_foreign, "1",
                   "datagrams of an address that no session is bound to"),
    FARHAND_COLUMN(StationCounters, Counters, dropped_too_long, "1", "datagrams longer than any of ours"),
    FARHAND_COLUMN(StationCounters, Counters, dropped_by_kernel, "1", "too long as well, or the socket was full"),
    FARHAND_COLUMN(StationCounters, Counters, dropped_handshake, "1",
                   "beyond the budget of their host, or the queue was full"),
    FARHAND_COLUMN(StationCounters, Counters, send_failed, "1", "refused by the system, or nobody listens there"),
};

#undef FARHAND_COLUMN
#undef FARHAND_COLUMN_OR_NONE

}  // namespace farhand
