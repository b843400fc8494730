// Vectors over the joints of a device, and the time that is passed to everything.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace farhand {

template <int N>
using Joints = Eigen::Array<double, N, 1>;

// Monotonic time of the local machine, or virtual time. Nothing below the run loop reads a clock: time is an argument.
using Nanoseconds = std::int64_t;

constexpr Nanoseconds kMicrosecond = 1'000;
constexpr Nanoseconds kMillisecond = 1'000'000;
constexpr Nanoseconds kSecond = 1'000'000'000;

constexpr double to_seconds(Nanoseconds t) { return static_cast<double>(t) * 1e-9; }
constexpr Nanoseconds from_seconds(double s) { return static_cast<Nanoseconds>(s * 1e9 + (s < 0 ? -0.5 : 0.5)); }

}  // namespace farhand
