// Student's t: number of standard errors within which 95 % of all results lie.
#pragma once

namespace farhand {

// The quantile 0.975 at n >= 1 degrees of freedom.
double student_975(int n) noexcept;

}  // namespace farhand
