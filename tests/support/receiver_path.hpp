// A receiver at the end of a link in virtual time.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "common/link/receiver.hpp"
#include "netem/link_model.hpp"

namespace farhand {

inline constexpr ReceiverParams kParams{
    .timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
inline constexpr std::uint32_t kSession = 77;
inline constexpr std::uint32_t kOwn = 5;

using Receiver1 = Receiver<1>;
inline std::unique_ptr<Receiver1> make_receiver(const ReceiverParams& params = kParams) {
  return std::make_unique<Receiver1>(params, kOwn);
}

inline std::uint64_t split_mix(std::uint64_t& x) {
  std::uint64_t z = x += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}
inline double unit(std::uint64_t& seed) { return static_cast<double>(split_mix(seed) >> 11) * 0x1p-53; }

inline Packet<1> packet_at(std::uint32_t seq, Nanoseconds stamp, double x = 0.0) {
  Packet<1> packet{.session = kSession, .seq = seq, .send_time_ns = stamp, .motion = {}};
  packet.motion.x[0] = x;
  return packet;
}

// One direction in virtual time: a sender that ticks every millisecond of its own clock, a link, a receiver that ticks
// every millisecond. True time is the receiver's.
struct Path {
  LinkModelParams link;
  std::uint64_t seed = 1;
  double offset_s = 0.0;         // sender's clock at true time 0
  double skew_ppm = 0.0;         // how much faster the sender's clock runs
  Nanoseconds sender_phase = 0;  // its first tick
  Nanoseconds tick = kMillisecond;

  // show(now, true sending time of what is shown, played); returns the receiver's counters. A position is the true
  // sending time in s.
  template <class Show>
  ReceiverCounters run(Nanoseconds duration, Receiver1& receiver, Show show) const {
    LinkModel model(link, seed, LinkDirection::kForward);
    struct Flying {
      Nanoseconds due;
      Packet<1> packet;
    };
    const auto later = [](const Flying& a, const Flying& b) {
      return a.due != b.due ? a.due > b.due : a.packet.seq > b.packet.seq;
    };
    std::vector<Flying> heap;
    const double rate = 1.0 + skew_ppm * 1e-6;
    Nanoseconds next_send = sender_phase;
    std::uint32_t seq = 1;
    std::int64_t sent = 0;
    for (Nanoseconds now = 0; now < duration; now += tick) {
      while (next_send <= now) {
        // Stamps are exact multiples of the sender's period; the true instant follows from the rate.
        const Nanoseconds stamp = from_seconds(offset_s) + sender_phase + sent * tick;
        const auto fate = model.offer(next_send);
        if (!fate.lost) {
          heap.push_back({next_send + fate.delay, packet_at(seq, stamp, to_seconds(next_send))});
          std::push_heap(heap.begin(), heap.end(), later);
        }
        ++seq;
        ++sent;
        next_send = sender_phase + static_cast<Nanoseconds>(
                                       std::llround(static_cast<double>(sent) * static_cast<double>(tick) / rate));
      }
      while (!heap.empty() && heap.front().due <= now) {
        receiver.accept(heap.front().packet, heap.front().due);
        std::pop_heap(heap.begin(), heap.end(), later);
        heap.pop_back();
      }
      const Played<1> played = receiver.play(now);
      if (played.any) show(now, played);
    }
    return receiver.counters();
  }
};

}  // namespace farhand
