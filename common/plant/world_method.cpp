#include "common/plant/world_method.hpp"

#include <sstream>
#include <stdexcept>

namespace farhand {

void check_stable(Method method, double rate, double step) {
  const double longest = (method == Method::kRk4 ? kRk4StableRadius : kSemiImplicitStableRadius) / rate;
  if (step > 0 && step <= longest) return;
  std::ostringstream message;
  message << "world.step_s = " << step << " s is too long for " << name_of(method)
          << " in this world: its fastest motion or stiffest contact needs more than 0 and at most " << longest
          << " s; give a shorter step or an implicit method";
  throw std::invalid_argument(message.str());
}

}  // namespace farhand
