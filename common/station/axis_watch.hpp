// Supervision of the own axis, on both sides: implausible readings, and shaking. The results are faults and a lower
// gain of the peer's commands. No content of a packet is an input.
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
  Motion<N> reference;                   // motion that the drive followed last
  Joints<N> torque;                      // torque that it last applied, or asked its device for
  bool gives_torque = true;              // the drive applies `torque` itself
  DeviceReadings device;                 // slow readings, where the device has them
  bool driven = false, engaged = false;  // since the last tick
  bool valid = true;                     // the device was read; else local is of an earlier tick
  int periods = 1;                       // of the device, since the reading before; 0: the same reading again
  bool continues = true;                 // its angle is known, with the same zero as in the last tick
  int ticks = 1;                         // periods since the last
};

struct GuardVerdict {
  std::optional<Reason> fault;             // latched like any fault
  bool hold = false;                       // asks for Holding
  bool shaken = false;                     // asks for Holding because of shaking, and forbids engaging
  double shaking = 0.0;                    // RMS of the velocity in the band of shaking, rad/s
  double gain = 1.0;                       // 0..1
  std::uint32_t limits = 0, warnings = 0;  // LimitBit, both
};

// The motion to follow when the peer's commands have the gain g.
template <int N>
Motion<N> yielding(const Motion<N>& local, const Motion<N>& target, double g) noexcept {
  if (g >= 1.0) return target;
  return {local.x + g * (target.x - local.x), g * target.v, g * target.f};
}

template <int N>
class AxisWatch {
 public:
  explicit AxisWatch(const GuardParams& params) noexcept;

  // Adds its findings to the verdict and lowers the gain.
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
