#include "common/analysis/steady_contact.hpp"

#include <algorithm>
#include <cmath>

#include "common/analysis/bisect.hpp"

namespace farhand {

double SteadyContact::slave_torque(double alpha) const {
  return std::abs(K_h * reach) / (1.0 + K_h / k + 0.5 * alpha * (K_h * K_f / K_p - 1.0));
}

double resting_alpha(const SteadyContact& contact, double f_1, double f_2) {
  constexpr int kSteps = 1000;
  for (int i = kSteps; i > 0; --i) {
    const double alpha = static_cast<double>(i) / kSteps;
    const double wanted = std::clamp((f_2 - contact.slave_torque(alpha)) / (f_2 - f_1), 0.0, 1.0);
    if (wanted >= alpha) return alpha;
  }
  return 0.0;
}

double largest_f_2(const SteadyContact& contact, double f_1) {
  const auto lets_go = [&](double f_2) { return resting_alpha(contact, f_1, f_2) < 0.01; };
  return first_failure(lets_go, std::max(f_1, 1e-6) * (1.0 + 1e-6), 1e3);
}

}  // namespace farhand
