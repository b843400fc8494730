// What goes in and out of the two kinds of axis a station can stand on, apart from the laws between.
#pragma once

#include <optional>

#include "common/signal/motion.hpp"

namespace farhand {

// What a device tells besides, slowly, where it can.
struct DeviceReadings {
  std::optional<double> motor_current;        // A
  std::optional<double> surface_temperature;  // deg C, of the motor
};

// A motor that takes a torque.
template <int N>
struct DirectIo {
  struct Sensed {
    Joints<N> x = Joints<N>::Zero();  // rad
    bool valid = true;                // false: the device cannot be read
    DeviceReadings device = {};
    bool finite() const noexcept { return x.allFinite(); }
  };
  struct Command {
    Joints<N> torque = Joints<N>::Zero();  // N m
  };
};

// An axis behind its own controller, which takes the motion to follow.
template <int N>
struct ReferenceIo {
  struct Sensed {
    Joints<N> x = Joints<N>::Zero();  // rad
    Joints<N> f = Joints<N>::Zero();  // reaction, N m
    bool valid = false;               // false: no fresh telemetry, or the device is in a fault
    bool at_rest = true;              // the device says that it follows nothing
    DeviceReadings device = {};
    bool finite() const noexcept { return x.allFinite() && f.allFinite(); }
  };
  struct Command {
    bool track = false;  // false: the device is to let go
    bool stop = false;   // and at once, instead of gently
    Motion<N> reference;
  };
};

}  // namespace farhand
