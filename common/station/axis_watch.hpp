// What each side watches of its own axis, whoever is in it: readings that cannot be, and shaking. Both are faults or
// lower what the peer's wishes count for; no packet enters.
#pragma once

#include <array>
#include <optional>

#include "common/station/drive_io.hpp"
#include "common/station/engagement.hpp"
#include "common/station/params.hpp"

namespace farhand {

template <int N>
struct GuardInputs {
  Motion<N> local;                       // as estimated in this tick
  Motion<N> reference;                   // what the drive was last given to follow
  Joints<N> torque;                      // that it last applied, or asked its device for
  bool gives_torque = true;              // the former
  DeviceReadings device;                 // slow readings, where the device has them
  bool driven = false, engaged = false;  // since the last tick
  bool valid = true;                     // the device was read; else local is of an earlier tick
  int periods = 1;                       // of the device, since the reading before; 0: that one again
  bool continues = true;                 // its angle is known, and counts from where that of the last tick did
  int ticks = 1;                         // periods since the last
};

struct GuardVerdict {
  std::optional<Reason> fault;             // latches as any fault does
  bool hold = false;                       // as the operator's
  bool shaken = false;                     // to be held for that, and not to be taken
  double shaking = 0.0;                    // RMS of the velocity in the band of shaking, rad/s
  double gain = 1.0;                       // 0..1
  std::uint32_t limits = 0, warnings = 0;  // LimitBit, both
};

// The motion to follow under gain g.
template <int N>
Motion<N> yielding(const Motion<N>& local, const Motion<N>& target, double g) noexcept {
  if (g >= 1.0) return target;
  return {local.x + g * (target.x - local.x), g * target.v, g * target.f};
}

template <int N>
class AxisWatch {
 public:
  explicit AxisWatch(const GuardParams& params) noexcept;

  // Adds to the verdict what it finds, and takes from its gain.
  void step(const GuardInputs<N>& in, GuardVerdict& verdict) noexcept;

 private:
  struct Joint {
    Plausibility plausibility;
    Oscillation oscillation;
  };
  double shaking_limit_;
  std::array<Joint, N> joints_;
};

extern template class AxisWatch<1>;

}  // namespace farhand
