// Names, settings, counters and end states that all integrators share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string_view>

namespace farhand {

enum class Method : std::uint8_t {
  kAuto,
  kSemiImplicitEuler,
  kRk4,
  kSdirk2,
  kRosenbrock,
  kAdaptive,
  kClosedForm,
};
constexpr std::size_t kMethods = 7;

constexpr std::string_view name_of(Method method) {
  constexpr std::array<std::string_view, kMethods> kNames{
      "auto", "semi-implicit Euler", "RK4", "SDIRK2", "Rosenbrock", "adaptive", "closed form"};
  return kNames[static_cast<std::size_t>(method)];
}

// Latched: the first that is not kOk stays until the next start.
enum class IntegratorStatus : std::uint8_t {
  kOk,
  kDiverged,    // the state left all bounds or was NaN; the last valid state is kept from then on
  kChattering,  // more events in one advance than allowed; that advance was finished in the mode of its last event
};

constexpr std::string_view name_of(IntegratorStatus status) {
  constexpr std::array<std::string_view, 3> kNames{"ok", "diverged", "chattering"};
  return kNames[static_cast<std::size_t>(status)];
}

struct IntegratorCounters {
  std::uint64_t steps = 0;        // accepted
  std::uint64_t events = 0;       // guards crossed
  std::uint64_t derivatives = 0;  // evaluations, those of rejected and repeated steps included
  std::uint64_t jacobians = 0;
  std::uint64_t rejected = 0;  // error too large, or Newton did not converge
  std::uint64_t unmet = 0;     // accepted although the error was too large: the step could not be shorter
};

struct IntegratorSettings {
  double max_step = 50e-6;  // s
  double rtol = 1e-8;       // of the adaptive pair: error per step below atol + rtol |state|
  double atol = 1e-10;
  int max_events = 1000;  // per advance
  double bound = 1e12;    // a state beyond it is called diverged
};

inline void check(const IntegratorSettings& settings) {
  if (!(settings.max_step > 0)) throw std::invalid_argument("an integrator needs a step above 0 s");
  if (!(settings.rtol >= 1e-15 && settings.rtol < 1) || !(settings.atol >= 0))
    throw std::invalid_argument("an integrator needs rtol from 1e-15 to 1 and atol of at least 0");
  if (settings.max_events < 1) throw std::invalid_argument("an integrator must be allowed at least one event");
}

}  // namespace farhand
