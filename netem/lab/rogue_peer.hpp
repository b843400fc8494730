// A malicious peer with the right key: it makes packets by a plan, one tick after the other, and knows the motion of
// the person on the other side.
#pragma once

#include <vector>

#include "netem/lab/rogue_plan.hpp"

namespace farhand::rogue {

// The peer's knowledge of the tested side; without delay, which is better than any network.
struct Seen {
  double t_s = 0;
  double x = 0, v = 0, f = 0;  // true ones of the person
  StationState state = StationState::kOff;
  Packet<1> packet;  // the newest that was sent to the peer
};

class Peer {
 public:
  // told_as: which side the peer plays. seed: of its noise.
  Peer(const Plan& plan, Against against, std::uint64_t seed);

  // Packets that leave in this tick, the first one first. Every number in them is finite, as the codec demands.
  const std::vector<Packet<1>>& tick(const Seen& seen);

  bool engaged_once() const noexcept { return engaged_from_s_ >= 0; }
  double engaged_from_s() const noexcept { return engaged_from_s_; }  // < 0: not yet
  bool silent() const noexcept { return silent_; }                    // has sent its last packet
  double last_packet_s() const noexcept { return last_packet_s_; }

 private:
  static constexpr std::size_t kPast = 32;  // ticks

  void begin_segment(std::size_t k);
  void move_on();
  double shape_of(const Channel& channel);
  double say(const Channel& channel, double now, double at_start, double legal);
  StationState wanted_state();
  bool after_gap() const;
  Motion<1> honest() const;
  void post(Packet<1> packet);

  Plan plan_;
  Against against_;
  Dice dice_;
  std::array<Seen, kPast> past_{};
  Seen seen_;
  std::size_t ticks_ = 0;

  std::size_t segment_ = 0;
  double segment_from_s_ = 0;
  Seen segment_start_;
  double x_said_ = 0;
  bool said_ = false;

  bool attacks_ = false;
  double engaged_from_s_ = -1, disengaged_from_s_ = -1, last_packet_s_ = -1;
  bool silent_ = false;
  int last_words_ = 0;

  std::uint32_t session_ = 77, seq_ = 0;
  double stamp_off_s_ = 0;
  double energy_ = 0;
  std::vector<Packet<1>> out_, kept_;
};

}  // namespace farhand::rogue
