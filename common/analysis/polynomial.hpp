// Polynomials of a discrete-time loop in z, and the factor per tick of its slowest or fastest-growing motion.
#pragma once

#include <complex>
#include <vector>

namespace farhand {

// Coefficients from the constant up.
using Polynomial = std::vector<double>;

Polynomial operator*(const Polynomial& a, const Polynomial& b);
Polynomial operator+(const Polynomial& a, const Polynomial& b);
Polynomial operator*(double factor, const Polynomial& a);

std::complex<double> value(const Polynomial& a, std::complex<double> z);

// (a - a(1)) / (z - 1): takes out a root at exactly 1.
Polynomial without_root_at_one(const Polynomial& a);

// Largest modulus of a root; 0 for a constant.
double spectral_radius(const Polynomial& a);

}  // namespace farhand
