// The board around the ATmega1284P as both sides of a test see it: clock, scales, and which pin does what.
// Freestanding, like the core.
//
//   PA0 spring's torque sensor   PB0 SEL1  \                          PD0 RXD0, PD1 TXD0: the serial line
//   PA1 temperature, 10 mV/deg C PB1 SEL2   | HCTL-2032, two 32-bit   PD2 patient's stop: opens when pressed, pulled up
//   PA2 motor current            PB2 X/Y    | quadrature counters     PD3 release key: closes to ground when pressed
//                                PB3 OE/   /  with a byte-wide bus    PD4 drive enable   PD5 direction, high: positive
//                                PC0-PC7 its bus                      PB6 PWM: speed (OC3A)
//
// Each wire fails to the safe side: a disconnected stop counts as pressed, a disconnected release key as not pressed,
// and the drive's enable is pulled down. The counter has its own clock, counts every edge (EN1, EN2), and is reset only
// with its power. It runs from the supply of the MCU but at lower voltages too, and therefore survives the brown-out
// that resets the MCU.
//
// The encoders are counted outside the MCU. At 4 rad/s a count of an encoder with 20000 counts per turn lasts 79 us,
// and a joint that the spring throws is four times as fast. Pin-change interrupts for 64000 edges a second of two
// encoders would take a third of this MCU, and a missed edge makes the angle wrong for ever, although it looks
// plausible. The counter misses no edge and keeps its count through a reset of the MCU.
#pragma once

#include <stdint.h>

#include "slave/mcu/orthosis_mcu.hpp"

namespace farhand {
namespace mcu {

constexpr uint32_t kClockHz = 14745600;
constexpr uint32_t kBaud = 115200;
constexpr uint16_t kBaudDivider = kClockHz / (16 * kBaud) - 1;
static_assert(kClockHz % (16 * kBaud) == 0, "the baud rate is exact");

// 14745600 / 2000 is 7372.8: the loop is 27 ppm slow, which is within the tolerance of crystals.
constexpr uint16_t kCyclesPerLoop = 7373;

// 20 kHz, which the patient does not hear; 4 rad/s in steps of 5.4 mrad/s, a tenth of the noise of one encoder count.
constexpr uint16_t kPwmTop = kClockHz / 20000 - 1;

enum AnalogInput : uint8_t { kSensorInput = 0, kTemperatureInput = 1, kCurrentInput = 2 };
constexpr uint16_t kReferenceMillivolts = 5000;

enum CounterPin : uint8_t { kSelect1 = 0, kSelect2 = 1, kMotorAxis = 2, kOutputDisable = 3 };
enum PortD : uint8_t { kStopPin = 2, kReleasePin = 3, kEnablePin = 4, kDirectionPin = 5 };

// The drive takes a speed: PWM from 0 to its rated speed, and a sign.
struct DriveSignal {
  uint16_t duty;  // of kPwmTop
  bool positive;
};
inline DriveSignal drive_signal(int32_t motor_velocity, Gain duty_per_velocity) {
  const bool positive = motor_velocity >= 0;
  const int32_t duty = times(positive ? motor_velocity : -motor_velocity, duty_per_velocity);
  return {static_cast<uint16_t>(duty > kPwmTop ? kPwmTop : duty), positive};
}

// 10 mV per degree of 5000 mV in 1024 counts.
inline int8_t temperature_c(uint16_t counts) {
  const uint16_t degrees = static_cast<uint16_t>((static_cast<uint32_t>(counts) * 500 + 512) >> 10);
  return static_cast<int8_t>(degrees > 127 ? 127 : degrees);
}

}  // namespace mcu
}  // namespace farhand
