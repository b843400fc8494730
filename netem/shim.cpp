#include "netem/shim.hpp"

#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cstring>
#include <ctime>

#include "common/runtime/run_loop.hpp"

namespace farhand {
namespace {

// Goes before the bytes while they wait.
struct Stamp {
  Nanoseconds entered;
  Nanoseconds due;
};

}  // namespace

Shim::Shim(const UdpEndpoint& listen, const UdpEndpoint& master, const LinkModelParams& forward,
           const LinkModelParams& backward, std::uint64_t seed)
    : to_slave_(UdpSocket::listen(listen)),
      to_master_(UdpSocket::dial(master)),
      forward_{.model = LinkModel(forward, seed, LinkDirection::kForward),
               .in = &to_master_,
               .out = &to_slave_,
               .forward = true},
      backward_{.model = LinkModel(backward, seed, LinkDirection::kBackward),
                .in = &to_slave_,
                .out = &to_master_,
                .forward = false} {
  // The first question makes the kernel stamp what comes from now on.
  arrival(forward_);
  arrival(backward_);
  for (UdpSocket* socket : {&to_slave_, &to_master_}) {
    socket->refuse_longer_than(PendingDatagrams::kMaxBytes - sizeof(Stamp));
  }
}

void Shim::run(Nanoseconds duration, const StopSignals& stop, const OnPacket& on_packet) {
  constexpr Nanoseconds kLongestWait =
      50 * kMillisecond;  // bounds how late a signal is noticed that comes just before the wait
  const Nanoseconds end = duration > 0 ? monotonic_now() + duration : std::numeric_limits<Nanoseconds>::max();
  while (stop.signal() == 0 && monotonic_now() < end) {
    for (ShimWay* way : {&forward_, &backward_}) take_in(*way, on_packet);
    for (ShimWay* way : {&forward_, &backward_}) let_out(*way, on_packet);
    Nanoseconds until = std::min(monotonic_now() + kLongestWait, end);
    for (const ShimWay* way : {&forward_, &backward_}) {
      if (!way->waiting.empty()) until = std::min(until, way->waiting.due());
    }
    wait(until);
  }
}

void Shim::wait(Nanoseconds until) const noexcept {
  std::array<pollfd, 2> sockets{pollfd{to_slave_.native_handle(), POLLIN, 0},
                                pollfd{to_master_.native_handle(), POLLIN, 0}};
  const Nanoseconds left = std::max<Nanoseconds>(until - monotonic_now(), 0);
  const timespec timeout{left / kSecond, left % kSecond};
  ppoll(sockets.data(), sockets.size(), &timeout, nullptr);
}

// When the newest datagram reached the machine. Without the kernel's stamp a late wake-up of ours would add to the
// delay unseen. The stamp is of the wall clock, which may be set at any time: hence the clamp. The wall clock is read
// first, so that a pause between the two readings makes a delay longer, never shorter than asked.
Nanoseconds Shim::arrival(const ShimWay& way) const noexcept {
  timespec stamp{}, wall{};
  if (ioctl(way.in->native_handle(), SIOCGSTAMPNS, &stamp) != 0) return monotonic_now();
  clock_gettime(CLOCK_REALTIME, &wall);
  const Nanoseconds now = monotonic_now();
  const Nanoseconds age = (wall.tv_sec - stamp.tv_sec) * kSecond + (wall.tv_nsec - stamp.tv_nsec);
  return std::clamp(now - age, std::min(way.newest_arrival_ns, now), now);
}

void Shim::take_in(ShimWay& way, const OnPacket& on_packet) {
  std::array<std::byte, PendingDatagrams::kMaxBytes> bytes;
  const std::span room = std::span(bytes).subspan(sizeof(Stamp));
  // Bounded, so that a flood from one side does not starve the other.
  for (int i = 0; i < 64; ++i) {
    const auto received = way.in->receive(room);
    if (!received) return;
    if (received->dropped) continue;
    way.in->accept(received->sender);
    const Nanoseconds entered = arrival(way);
    way.newest_arrival_ns = entered;
    if (first_packet_ns_ < 0) first_packet_ns_ = entered;

    const LinkModel::Fate fate = way.model.offer(entered - first_packet_ns_);
    ++way.entered;
    const Stamp stamp{entered, entered + fate.delay};
    std::memcpy(bytes.data(), &stamp, sizeof stamp);
    const bool kept = !fate.lost && way.waiting.push(stamp.due, std::span(bytes).first(sizeof stamp + received->size));
    if (fate.lost) ++way.lost;
    if (!fate.lost && !kept) ++way.overflow;
    if (kept) way.asked.add(fate.delay);
    if (!kept && on_packet) {
      on_packet(entered, {.t_s = to_seconds(entered - first_packet_ns_),
                          .forward = way.forward,
                          .lost = true,
                          .asked_delay_s = to_seconds(fate.delay),
                          .achieved_delay_s = 0});
    }
  }
}

void Shim::let_out(ShimWay& way, const OnPacket& on_packet) {
  while (!way.waiting.empty() && way.waiting.due() <= monotonic_now()) {
    const std::span<const std::byte> bytes = way.waiting.pop();
    Stamp stamp{};
    std::memcpy(&stamp, bytes.data(), sizeof stamp);
    const bool sent = way.out->send(bytes.subspan(sizeof stamp));
    const Nanoseconds now = monotonic_now();
    if (!sent) ++way.unsent;
    if (sent) way.achieved.add(now - stamp.entered);
    if (sent) way.lateness.add(now - stamp.due);
    if (on_packet) {
      on_packet(stamp.entered, {.t_s = to_seconds(stamp.entered - first_packet_ns_),
                                .forward = way.forward,
                                .lost = !sent,
                                .asked_delay_s = to_seconds(stamp.due - stamp.entered),
                                .achieved_delay_s = sent ? to_seconds(now - stamp.entered) : 0});
    }
  }
}

}  // namespace farhand
