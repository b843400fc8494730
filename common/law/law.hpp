// A control architecture on one side: an object that holds exactly its blocks and wires them in one step. It says what
// the axis is to follow and what the peer is told; on what axis it stands it does not know.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>

#include "common/signal/motion.hpp"

namespace farhand {

// What a law is told of the time since its last step.
struct Elapsed {
  int ticks = 1;      // periods; more than one means that some were missed
  bool held = false;  // nothing newer of the peer has arrived: what was shown last is repeated
  // Since the last gap there was time for what the peer shows to be where it is, to be learnt from, and for its
  // friction.
  bool rested = true, settled = true, calm = true;
  double silent_s = 0.0;                    // since something newer was shown
  double acting = 1.0, peers_acting = 1.0;  // how much of the time the drives acted of late, here and there
};

// Of the energy that went through the port since the last tick.
template <int N>
struct Account {
  Joints<N> torque = Joints<N>::Zero();  // N m, that acted on the axis, without what carries its weight
  double acted = 1.0;                    // of the torque that the law asked for last: 1, less across a gap
  Joints<N> moved = Joints<N>::Zero();   // rad, in that time
  double received = 0.0;                 // J, what the peer has told of so far
  bool engaged = false;                  // in that time
};

// As measured now.
struct NetworkNow {
  double round_trip = 0.0;  // s, of content: the packet's own and twice the play-out depth; 0 before it is known
  double loss = 0.0;        // share of the packets, lost or late
};

// Beside the motions. What a law does not need is not measured for it, and not in the packets.
struct LawNeeds {
  bool account = false;  // Account, and the energy in each packet
  bool network = false;  // NetworkNow
};

template <int N>
struct LawInputs {
  Motion<N> local;     // of this axis
  Motion<N> received;  // of the peer, in this side's own size and within its limits
  Elapsed since;
  bool engaged = false;                 // what the law wishes is followed
  Account<N> account;                   // where it is needed
  const NetworkNow* network = nullptr;  // so too; none while nothing can be said of it
};

// What the peer is told of an axis, in place of its motion. Every packet has one layout.
template <int N>
struct Told {
  Joints<N> x = Joints<N>::Zero();  // rad
  Joints<N> v = Joints<N>::Zero();  // rad/s
  // The reaction in N m; or what the architecture sends instead: the torque of the master, N m, or the integral of a
  // wave, sqrt(W) s.
  Joints<N> u = Joints<N>::Zero();

  static Told motion(const Motion<N>& m) noexcept { return {m.x, m.v, m.f}; }
};

template <int N>
struct Wish {
  // What the axis is to follow. A torque tau is the motion that asks for it: where the axis is already, and the
  // reaction -tau. A drive that closes its loop here follows it,
  //
  //   a_ref = C_p (x - x) - K_f (-tau + f) = K_f (tau - f)
  //
  // by which the axis is an inertia of 1/K_f under tau, its own friction compensated.
  Motion<N> follow = {};
  // It is the torque that counts: a device behind its own controller is asked for that, by the same law without C_p,
  // whose x and v would come to it late.
  bool as_torque = false;
  Told<N> tell = {};
  double energy = 0.0;  // J, told with it: what was taken from this axis so far

  static Wish torque(const Joints<N>& tau, const Motion<N>& local) noexcept {
    return {.follow = {local.x, local.v, -tau}, .as_torque = true, .tell = Told<N>::motion(local)};
  }
};

inline constexpr std::size_t kMostLawSignals = 8;

// What a law shows of its first joint.
struct LawSignals {
  using Own = std::array<double, kMostLawSignals>;
  using Remark = int (*)(const Own&, std::span<char>) noexcept;
  static constexpr Own nothing() noexcept {
    Own none{};
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
  }

  double x_cdob = 0.0;  // rad, what is followed beyond what was received, before alpha
  double alpha = 1.0;   // of that, what is used
  Own own = nothing();  // in the order of its row
  // A sentence on what was decided last, made of own outside the tick, whenever decisions has grown; as snprintf.
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

  // Engaged from this tick on; before its step.
  virtual void start(const LawInputs<N>& in) noexcept = 0;
  // Once per tick, engaged or not. Not engaged, what it wishes to follow is nobody's concern, and it tells.
  virtual Wish<N> step(const LawInputs<N>& in) noexcept = 0;
  virtual LawSignals signals() const noexcept { return {}; }

 private:
  LawNeeds needs_;
};

}  // namespace farhand
