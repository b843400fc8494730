#include "common/integrate/eigenvalues.hpp"

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

std::vector<std::complex<double>> eigenvalues(std::span<const double> row_by_row, std::size_t size) {
  const auto n = static_cast<Eigen::Index>(size);
  Eigen::MatrixXd m = Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(row_by_row.data(), n, n);
  if (n == 0 || !m.allFinite()) return {};
  balance(m);
  // The Schur form has them on its diagonal, complex pairs in blocks of two. Half the compiler's work of EigenSolver.
  const Eigen::RealSchur<Eigen::MatrixXd> schur(m, false);
  if (schur.info() != Eigen::Success) return {};
  const Eigen::MatrixXd& T = schur.matrixT();
  std::vector<std::complex<double>> found;
  found.reserve(size);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (i + 1 == n || T(i + 1, i) == 0.0) {
      found.emplace_back(T(i, i));
      continue;
    }
    const double half = 0.5 * (T(i, i) - T(i + 1, i + 1)), middle = 0.5 * (T(i, i) + T(i + 1, i + 1));
    const std::complex<double> root = std::sqrt(std::complex<double>(half * half + T(i, i + 1) * T(i + 1, i)));
    found.push_back(middle + root);
    found.push_back(middle - root);
    ++i;
  }
  return found;
}

std::complex<double> fastest_eigenvalue(std::span<const double> row_by_row, std::size_t size) {
  const std::vector<std::complex<double>> all = eigenvalues(row_by_row, size);
  if (all.size() < size) return std::numeric_limits<double>::infinity();
  std::complex<double> fastest = 0;
  for (const auto& eigenvalue : all)
    if (std::abs(eigenvalue) > std::abs(fastest)) fastest = eigenvalue;
  return fastest;
}

}  // namespace farhand
