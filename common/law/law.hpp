// A control architecture on one side: an object that holds exactly its blocks and wires them in one step. Its results
// are the motion that the axis shall follow and the content of the next packet. A law does not know its axis.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>

#include "common/signal/motion.hpp"

namespace farhand {

// The time since the last step of a law.
struct Elapsed {
  int ticks = 1;      // periods; more than one means that some were missed
  bool held = false;  // nothing newer has arrived from the peer: the last motion is repeated
  // The last gap in time is long enough ago to learn where the peer's contact begins (rested), its stiffness (settled),
  // and its device's friction (calm).
  bool rested = true, settled = true, calm = true;
  double silent_s = 0.0;                    // since a newer motion of the peer was shown
  double acting = 1.0, peers_acting = 1.0;  // recent mean share of the command that the own and the peer's drive gave
};

// The energy that went through the port since the last tick.
template <int N>
struct Account {
  Joints<N> torque = Joints<N>::Zero();  // N m, that acted on the axis, without the compensation of its weight
  double acted = 1.0;                    // share of the law's last torque that was given: 1, less across a gap
  Joints<N> moved = Joints<N>::Zero();   // rad, in that time
  double received = 0.0;                 // J, sum of the energy that the peer has reported so far
  bool engaged = false;                  // in that time
};

// The network as measured now.
struct NetworkNow {
  double round_trip = 0.0;  // s, of content: the packet's own and twice the play-out depth
  double loss = 0.0;        // share of the packets, lost or late
};

// Inputs that a law needs beside the motions. Other inputs are neither measured nor put into the packets.
struct LawNeeds {
  bool account = false;  // Account, and the energy in each packet
  bool network = false;  // NetworkNow
  // Each packet tells the sample before once more, and the peer fills a single lost packet from it.
  bool previous = false;
};

template <int N>
struct LawInputs {
  Motion<N> local;     // of this axis
  Motion<N> received;  // of the peer, scaled to this side and within its limits
  Elapsed since;
  bool engaged = false;                 // the axis follows the law
  Account<N> account;                   // only if LawNeeds asks for it
  const NetworkNow* network = nullptr;  // only if LawNeeds asks for it; null while unknown
  // Friction of the peer's device that its reaction contains, N m, scaled to this side and from 0 to the own limit of
  // torque: a reaction below it may come without a contact. NaN while the peer has not told it. Known: measured by an
  // empty sweep not older than a day; else only assumed.
  double peer_friction = std::numeric_limits<double>::quiet_NaN();
  bool peer_friction_known = false;
};

// What a packet tells the peer in place of the axis' motion. The layout of packets is the same for every law.
template <int N>
struct Told {
  Joints<N> x = Joints<N>::Zero();  // rad
  Joints<N> v = Joints<N>::Zero();  // rad/s
  // The reaction torque in N m, or the quantity that the architecture sends instead: the torque of the master, N m, or
  // the integral of a wave, sqrt(W) s.
  Joints<N> u = Joints<N>::Zero();

  static Told motion(const Motion<N>& m) noexcept { return {m.x, m.v, m.f}; }
};

template <int N>
struct Wish {
  // The motion that the axis shall follow. A law that asks for a torque tau gives the axis' own motion with the
  // reaction -tau. A drive whose loop is closed here then computes
  //
  //   a_ref = C_p (x - x) - K_f (-tau + f) = K_f (tau - f)
  //
  // so that the axis behaves as an inertia of 1/K_f under tau, with its own friction compensated.
  Motion<N> follow = {};
  // True: only the torque counts. A device with a controller of its own gets the torque and applies the same law
  // without C_p, because x and v would reach it late.
  bool as_torque = false;
  Told<N> tell = {};
  double energy = 0.0;  // J, sent with it: sum of the energy taken from this axis so far

  static Wish torque(const Joints<N>& tau, const Motion<N>& local) noexcept {
    return {.follow = {local.x, local.v, -tau}, .as_torque = true, .tell = Told<N>::motion(local)};
  }
};

inline constexpr std::size_t kMostLawSignals = 8;

// The values that a law records of its first joint.
struct LawSignals {
  using Own = std::array<double, kMostLawSignals>;
  using Remark = int (*)(const Own&, std::span<char>) noexcept;
  static constexpr Own nothing() noexcept {
    Own none{};
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
  }

  double x_cdob = 0.0;  // rad, compensation added to the received angle, before alpha
  double alpha = 1.0;   // share of the compensation that is used
  Own own = nothing();  // in the order of the signals in its row
  // Count of decisions. When it has grown, a sentence on the last decision is made from `own`, outside the tick, in the
  // manner of snprintf.
  int decisions = 0;
  Remark remark = nullptr;
};

template <int N>
class Law {
 public:
  explicit Law(LawNeeds needs = {}) noexcept : needs_(needs) {}
  virtual ~Law() = default;
  Law(const Law&) = delete;
  Law& operator=(const Law&) = delete;

  const LawNeeds& needs() const noexcept { return needs_; }

  // The station is engaged from this tick on; called before step().
  virtual void start(const LawInputs<N>& in) noexcept = 0;
  // Once per tick, engaged or not. While not engaged only the part of the wish that is sent to the peer is used.
  virtual Wish<N> step(const LawInputs<N>& in) noexcept = 0;
  virtual LawSignals signals() const noexcept { return {}; }

 private:
  LawNeeds needs_;
};

}  // namespace farhand
