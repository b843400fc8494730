// The laws of the stations without their stations, for one joint: what a bare loop runs on each side. Behind one face
// and compiled in one source, because plants and integrators would multiply them.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "common/station/params.hpp"

namespace farhand {

// What one side tells the other.
template <class T>
struct Sent {
  T x{}, v{}, f{};
};

// A drive that takes a torque, under the law of a scene, driven from the start.
template <class T>
class BareLaw {
 public:
  virtual ~BareLaw() = default;
  // At rest at x, with the peer last heard of at `received`.
  virtual void reset(T x, const Sent<T>& received) noexcept = 0;
  // Once per tick: the angle read, and what is sent of it; then the torque to hold until the next tick.
  virtual Sent<T> observe(T x) noexcept = 0;
  virtual T follow(const Sent<T>& received) noexcept = 0;
  virtual std::uint32_t limits() const noexcept = 0;  // that acted on it
};

inline constexpr const char* kNoBareLaw =
    "the bare loop knows plain four channels, with CDOB and with SDCV; this architecture runs in whole sessions only";

// Under every compensation the patient's side is plain four channels. Throws std::invalid_argument for what no bare
// loop knows.
std::string_view bare_law_of(std::string_view architecture, Role role);

// The product's blocks: the master of this architecture.
std::unique_ptr<BareLaw<double>> make_block_law(std::string_view architecture, const ControlParams& params);
// The same by hand, in any scalar.
template <class T>
std::unique_ptr<BareLaw<T>> make_plain_law(std::string_view architecture, const ControlParams& params);

}  // namespace farhand
