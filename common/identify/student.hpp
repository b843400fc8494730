// Student's t: how many standard errors reach as far as 95 % of all results.
#pragma once

namespace farhand {

// The quantile 0.975 at n >= 1 degrees of freedom.
double student_975(int n) noexcept;

}  // namespace farhand
