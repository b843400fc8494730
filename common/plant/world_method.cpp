#include "common/plant/world_method.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace farhand {

double longest_step(Method method, std::complex<double> eigenvalue) {
  const double rate = std::abs(eigenvalue);
  switch (method) {
    case Method::kRk4:
      return kRk4StableRadius / rate;
    case Method::kSemiImplicitEuler: {
      // v'' + 2 zeta w v' + w^2 v = 0 stays while (w h)^2 + 4 zeta w h < 4. Of a real eigenvalue only the faster of two
      // is known: the worst is that they are equal.
      const double zeta = std::abs(eigenvalue.real()) / rate;
      return 2.0 * (std::sqrt(1.0 + zeta * zeta) - zeta) / rate;
    }
    default:
      return std::numeric_limits<double>::infinity();
  }
}

void check_step(Method method, double step, double longest) {
  if (step > 0 && step <= longest) return;
  std::ostringstream message;
  message << "world.step_s = " << step << " s is too long for " << name_of(method)
          << " in this world: its fastest motion or stiffest contact needs more than 0 and at most " << longest
          << " s; give a shorter step, an implicit method or AUTO";
  throw std::invalid_argument(message.str());
}

}  // namespace farhand
