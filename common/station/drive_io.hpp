// Inputs and outputs of the two kinds of axis on which a station can work.
#pragma once

#include <cstdint>
#include <optional>

#include "common/signal/motion.hpp"

namespace farhand {

// A fault that a device finds in its own sensors.
enum class DeviceFault : std::uint8_t {
  kNone,
  kEncoder,  // an encoder shows a motion that no axis can make
  kSpring    // its spring's torque contradicts the encoders on both ends of the spring
};

// Judgement of the time that the line to a device needs for a command and its echo.
enum class LineQuality : std::uint8_t {
  kGood,
  kUnknown,  // not yet measured, or the device sends no numbers
  kSlow,     // too slow from the start
  kLags      // became too slow later
};

// Further values that some devices send at a low rate.
struct DeviceReadings {
  DeviceFault fault = DeviceFault::kNone;
  bool bounded = false;                       // it gives less than was asked for, to protect the person in it
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

// An axis behind its own controller, which takes references of a motion, or a torque.
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
    bool track = false;         // false: the device shall let go
    bool gives_torque = false;  // torque mode: torque -reference.f, damping K_d (reference.v - v); x is ignored
    bool stop = false;          // let go at once, not gently
    Motion<N> reference;
  };
};

}  // namespace farhand
