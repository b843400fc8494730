// One datagram as the stations see it, free of any encoding.
#pragma once

#include <cstdint>

#include "common/signal/limit_bits.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

inline constexpr std::uint32_t kProtocolVersion = 2;

// State of a station. The numbers are on the wire and in recordings: never reuse one.
enum class StationState : std::uint8_t {
  kReady = 0,
  kAligning = 1,
  kEngaged = 2,
  kHolding = 3,
  kFault = 4,
  kOff = 5,
  kSelfTest = 6,
  kHoming = 7,
  kStopped = 8,
  kIdentifying = 9,
  kSweeping = 10
};
inline constexpr StationState kLastState = StationState::kSweeping;  // the codec rejects anything beyond

template <int N>
struct Packet {
  std::uint32_t session = 0;       // drawn at start by the sender, never 0; a new one means the sender restarted
  std::uint32_t seq = 0;           // one per tick, never repeated within a session
  Nanoseconds send_time_ns = 0;    // sender's monotonic clock
  std::uint32_t echo_session = 0;  // newest session and seq received from the peer; 0, 0 before the first
  std::uint32_t echo_seq = 0;
  Nanoseconds echo_send_time_ns = 0;  // send stamp of the packet that is echoed (in the echo receiver's own clock)
  std::uint32_t echo_dwell_ns = 0;    // how long the echoed packet lay here: RTT = now - echo_send_time - dwell
  std::uint32_t expiry_ms = 0;  // the content must not be acted upon once older than this; 0: no limit of the sender's
  StationState state = StationState::kReady;
  std::uint32_t limits = 0;  // LimitBit, GapBit
  Motion<N> motion;
  double energy = 0.0;  // J so far, never falling; on the wire only if the law needs it (PacketCodec)
  // The motion of the packet before once more, so that a single lost packet leaves no gap. On the wire only if the law
  // needs it. Age: time between the two send stamps; 0: there is none.
  std::uint32_t previous_age_ns = 0;
  Motion<N> previous = {};
  // Friction of the sender's device that its reaction contains, N m; negative: unknown. Known: from an empty sweep not
  // older than a day; else it is only assumed.
  double friction = 0.0;
  bool friction_known = false;
};

}  // namespace farhand
