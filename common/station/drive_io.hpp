// What goes in and out of the two kinds of axis a station can stand on, apart from the laws between.
#pragma once

#include <cstdint>
#include <optional>

#include "common/signal/motion.hpp"

namespace farhand {

// What a device finds wrong with its own sensors.
enum class DeviceFault : std::uint8_t {
  kNone,
  kEncoder,  // an encoder shows what no axis does
  kSpring    // its spring's torque is not what the encoders on both ends of the spring say
};

// What the line to a device needs for a command there and its echo back.
enum class LineQuality : std::uint8_t {
  kGood,
  kUnknown,  // not yet measured, or the device does not tell
  kSlow,     // by itself, from the start
  kLags      // and did not at first
};

// What a device tells besides, slowly, where it can.
struct DeviceReadings {
  DeviceFault fault = DeviceFault::kNone;
  bool bounded = false;                       // it spares the person in it, by less than was asked for
  std::optional<double> motor_current;        // A
  std::optional<double> surface_temperature;  // deg C, of the motor
};

// A motor that takes a torque.
template <int N>
struct DirectIo {
  static constexpr int kJoints = N;
  struct Sensed {
    Joints<N> x = Joints<N>::Zero();  // rad
    bool valid = true;                // false: the device cannot be read
    int periods = 1;                  // of the device, since the reading before; 0: that one again
    DeviceReadings device = {};
    bool finite() const noexcept { return x.allFinite(); }
  };
  struct Command {
    Joints<N> torque = Joints<N>::Zero();  // N m
  };
};

// An axis behind its own controller, which takes the motion to follow, or a torque.
template <int N>
struct ReferenceIo {
  static constexpr int kJoints = N;
  struct Sensed {
    Joints<N> x = Joints<N>::Zero();  // rad
    Joints<N> f = Joints<N>::Zero();  // reaction, N m
    bool valid = false;               // false: no fresh telemetry, or the device is in a fault
    int periods = 1;                  // of the device, since the reading before; 0: that one again
    bool at_rest = true;              // the device says that it follows nothing
    LineQuality line = LineQuality::kGood;
    DeviceReadings device = {};
    bool finite() const noexcept { return x.allFinite() && f.allFinite(); }
  };
  struct Command {
    bool track = false;         // false: the device is to let go
    bool gives_torque = false;  // to give the torque -f, and to damp what leaves v, instead of following the motion
    bool stop = false;          // to let go at once, instead of gently
    Motion<N> reference;
  };
};

}  // namespace farhand
