#include "common/integrate/stiffness.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace farhand {
namespace {

// Osborne: rows and columns of like size, by powers of two. Without it a wall of 1e8 N m/rad beside a rate of 1 costs
// the eigenvalues half their digits.
void balance(Eigen::MatrixXd& m) {
  for (bool again = true; again;) {
    again = false;
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      const double on_diagonal = std::fabs(m(i, i));
      const double row = m.row(i).lpNorm<1>() - on_diagonal, column = m.col(i).lpNorm<1>() - on_diagonal;
      if (!(row > 0 && column > 0)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (factor == 1.0) continue;
      m.row(i) /= factor;
      m.col(i) *= factor;
      again = row / factor + column * factor < 0.95 * (row + column) || again;
    }
  }
}

}  // namespace

std::complex<double> fastest_eigenvalue(std::span<const double> row_by_row, std::size_t size) {
  const auto n = static_cast<Eigen::Index>(size);
  Eigen::MatrixXd m = Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(row_by_row.data(), n, n);
  if (!m.allFinite()) return std::numeric_limits<double>::infinity();
  balance(m);
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(m, false);
  std::complex<double> fastest = 0;
  for (const auto& eigenvalue : solver.eigenvalues())
    if (std::abs(eigenvalue) > std::abs(fastest)) fastest = eigenvalue;
  return fastest;
}

}  // namespace farhand
