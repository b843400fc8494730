// The laws of the stations without their stations, for one joint; a bare loop runs them on each side. They have one
// interface and are compiled in one source, because each combination with a plant and an integrator would be compiled
// otherwise.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "common/station/params.hpp"

namespace farhand {

// The motion that one side sends to the other.
template <class T>
struct Sent {
  T x{}, v{}, f{};
};

// A drive that takes a torque, under the law of a scene, driven from the start.
template <class T>
class BareLaw {
 public:
  virtual ~BareLaw() = default;
  // Starts at rest at x, with `received` as the last motion of the peer.
  virtual void reset(T x, const Sent<T>& received) noexcept = 0;
  // Once per tick: observe takes the angle and returns the motion to send; the next call returns the torque to hold
  // until the next tick.
  virtual Sent<T> observe(T x) noexcept = 0;
  virtual T follow(const Sent<T>& received) noexcept = 0;
  virtual std::uint32_t limits() const noexcept = 0;  // that acted on it
};

inline constexpr const char* kNoBareLaw =
    "the bare loop knows plain four channels, with CDOB and with SDCV; this architecture runs in whole sessions only";

// Under every compensation the patient's side is plain four channels. Throws std::invalid_argument for architectures
// that no bare loop has.
std::string_view bare_law_of(std::string_view architecture, Role role);

// The product's blocks: the master of this architecture.
std::unique_ptr<BareLaw<double>> make_block_law(std::string_view architecture, const ControlParams& params);
// The same, written by hand, for any scalar.
template <class T>
std::unique_ptr<BareLaw<T>> make_plain_law(std::string_view architecture, const ControlParams& params);

}  // namespace farhand
