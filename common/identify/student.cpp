#include "common/identify/student.hpp"

#include <algorithm>

namespace farhand {

double student_975(int n) noexcept {
  constexpr double kFew[] = {12.7062, 4.30265, 3.18245, 2.77645, 2.57058};
  if (n <= 5) return kFew[std::max(n, 1) - 1];
  // Cornish-Fisher expansion in 1/n (Abramowitz & Stegun 26.7.5): right to 1e-3 from n = 6 on.
  constexpr double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double r = 1.0 / n;
  return z +
         r * ((z3 + z) / 4 + r * ((5 * z5 + 16 * z3 + 3 * z) / 96 + r * (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / 384));
}

}  // namespace farhand
