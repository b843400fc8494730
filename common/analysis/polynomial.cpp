#include "common/analysis/polynomial.hpp"

#include "common/integrate/eigenvalues.hpp"

namespace farhand {

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  return product;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  Polynomial sum = a.size() >= b.size() ? a : b;
  const Polynomial& less = a.size() >= b.size() ? b : a;
  for (std::size_t i = 0; i < less.size(); ++i) sum[i] += less[i];
  return sum;
}

Polynomial operator*(double factor, const Polynomial& a) {
  Polynomial scaled = a;
  for (double& c : scaled) c *= factor;
  return scaled;
}

std::complex<double> value(const Polynomial& a, std::complex<double> z) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = a.size(); i > 0; --i) sum = sum * z + a[i - 1];
  return sum;
}

Polynomial without_root_at_one(const Polynomial& a) {
  Polynomial quotient(a.size() - 1, 0.0);
  double carried = 0.0;
  for (std::size_t i = a.size() - 1; i > 0; --i) quotient[i - 1] = carried += a[i];
  return quotient;
}

double spectral_radius(const Polynomial& a) {
  std::size_t degree = a.size() - 1;
  while (degree > 0 && a[degree] == 0.0) --degree;
  if (degree == 0) return 0.0;
  std::vector<double> companion(degree * degree, 0.0);
  for (std::size_t i = 0; i + 1 < degree; ++i) companion[(i + 1) * degree + i] = 1.0;
  for (std::size_t i = 0; i < degree; ++i) companion[i * degree + degree - 1] = -a[i] / a[degree];
  return std::abs(fastest_eigenvalue(companion, degree));
}

}  // namespace farhand
