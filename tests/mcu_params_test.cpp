// The scaled multiplication of the MCU core against exact products, and which parameters it refuses.
#include "slave/mcu/mcu_params.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

namespace farhand::mcu {
namespace {

constexpr double kDelta = 1.0 / 65536;  // relative error of a Gain

TEST(McuGain, IsWithinHalfA16BitStepOverItsWholeRange) {
  for (double value = 3e-10; value < 65000; value *= 1.37) {
    const Gain gain = make_gain("test", value);
    EXPECT_NEAR(std::ldexp(gain.mantissa, -gain.right), value, kDelta * value) << value;
  }
  EXPECT_EQ(make_gain("test", 0).mantissa, 0);
  EXPECT_EQ(make_gain("test", 1e-30).mantissa, 0);
  EXPECT_EQ(make_gain("test", 1.0 - 1e-9).mantissa, 32768);
}

TEST(McuGain, MultipliesToTheNearestUnitAndSaturates) {
  std::mt19937 random(1);
  for (int i = 0; i < 1'000'000; ++i) {
    const int bits = static_cast<int>(random() % 31);
    const auto value = static_cast<std::int32_t>(random() % ((1u << bits) + 1)) * (random() % 2 ? 1 : -1);
    const Gain gain{static_cast<std::uint16_t>(random() % 65536), static_cast<std::uint8_t>(random() % 48)};
    const double exact = std::ldexp(static_cast<double>(value) * gain.mantissa, -gain.right);
    const double expected = std::clamp(exact, -static_cast<double>(kLargest), static_cast<double>(kLargest));
    ASSERT_NEAR(times(value, gain), expected, gain.right > 16 ? 1.0 : 0.5)
        << value << ' ' << gain.mantissa << ' ' << +gain.right;
  }
}

TEST(McuParams, WhatDoesNotFitIsRefusedByName) {
  const auto refused = [](auto change) {
    McuSettings settings;
    change(settings);
    try {
      make_mcu_params(settings);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused([](McuSettings& s) { s.torque_limit = 9; }),
            "MCU: torque_limit = 9 does not fit; allowed is 0.001 to 8");
  EXPECT_NE(refused([](McuSettings& s) { s.loop_hz = 1500; }).find("loop_hz"), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.spring = 1e6; }).find("spring"), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.K_p = NAN; }).find("K_p"), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.K_f = -1; }).find("K_f"), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.range_min = 0.5; }).find("range_max"), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.g = 0; }).find("g ="), std::string::npos);
  EXPECT_NE(refused([](McuSettings& s) { s.power_limit = 0; }).find("power_limit"), std::string::npos);
  EXPECT_EQ(refused([](McuSettings&) {}), "accepted");
}

// v_allow = min(v_max, P / (torque + 0.1 N m)), and to a third of a rad/s at the torque limit, in the middle of each
// step of 1/32 N m, times J_n k_B.
TEST(McuParams, TheTableOfAllowedSpeedsIsThePowerOverTheTorque) {
  McuSettings settings;
  settings.power_limit = 2, settings.velocity_limit = 4;
  const McuParams p = make_mcu_params(settings);
  for (int step = 0; step < kResistanceSteps; ++step) {
    const double torque = (step + 0.5) / 32;
    const double v_allow = std::min({4.0, 2 / (torque + 0.1), std::max(5 * (1.07 - torque / 3), 0.0)});
    EXPECT_NEAR(to_nm(p.allowed_speed[step]), settings.J_n * 36 * v_allow, 1e-7);
  }
}

// Of 1000 N m/rad one count of 20000 is 0.3 N m, and two of each encoder are within their noise.
TEST(McuParams, ASpringSensorAllowsForTheCountsOfAStiffSpring) {
  McuSettings settings;
  settings.spring_sensor_nm = 8;
  EXPECT_NEAR(to_nm(make_mcu_params(settings).sensor_apart), 0.5, 1e-6);
  settings.spring = 1000;
  EXPECT_NEAR(to_nm(make_mcu_params(settings).sensor_apart), 4 * 1000 * 2 * M_PI / 20000, 1e-6);
  settings.spring = 1e5;
  EXPECT_NEAR(to_nm(make_mcu_params(settings).sensor_apart), 15, 1e-6);
  settings.spring_sensor_nm = 0;
  EXPECT_EQ(make_mcu_params(settings).sensor_apart, 0);
}

}  // namespace
}  // namespace farhand::mcu
