// Francis's double-shift QR on the Hessenberg form (Golub & Van Loan, Matrix Computations, 4th ed., algorithms 7.4.2,
// 7.5.1 and 7.5.2), without the vectors: only the active block is ever touched. Real arithmetic keeps complex pairs
// exactly conjugate.
#include "common/integrate/eigenvalues.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace farhand {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kSweepsPerEigenvalue = 60;  // three or so are usual

class Square {
 public:
  Square(std::span<const double> row_by_row, std::size_t size)
      : size_(static_cast<int>(size)), entries_(row_by_row.begin(), row_by_row.end()) {}
  int size() const { return size_; }
  double& operator()(int i, int j) { return entries_[static_cast<std::size_t>(i * size_ + j)]; }

 private:
  int size_;
  std::vector<double> entries_;
};

// Osborne: rows and columns of like size, by powers of two. Without it a wall of 1e8 N m/rad beside a rate of 1 costs
// the eigenvalues half their digits.
void balance(Square& A) {
  const int n = A.size();
  for (bool again = true; again;) {
    again = false;
    for (int i = 0; i < n; ++i) {
      double row = 0, column = 0;
      for (int j = 0; j < n; ++j) {
        if (j == i) continue;
        row += std::fabs(A(i, j));
        column += std::fabs(A(j, i));
      }
      if (!(row > 0 && column > 0)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (factor == 1.0) continue;
      for (int j = 0; j < n; ++j) A(i, j) /= factor;
      for (int j = 0; j < n; ++j) A(j, i) *= factor;
      again = row / factor + column * factor < 0.95 * (row + column) || again;
    }
  }
}

// Reflects what v points at onto its first axis: x - beta v (v' x). beta is 0 where there is nothing to reflect.
template <std::size_t K>
struct Reflection {
  std::array<double, K> v;
  double beta = 0;

  explicit Reflection(std::array<double, K> x) : v(x) {
    double largest = 0;
    for (const double xi : x) largest = std::max(largest, std::fabs(xi));
    if (largest == 0) return;
    double squares = 0;
    for (double& vi : v) {
      vi /= largest;
      squares += vi * vi;
    }
    v[0] += std::copysign(std::sqrt(squares), v[0]);
    squares = 0;
    for (const double vi : v) squares += vi * vi;
    beta = 2 / squares;
  }
  // On rows row.. of the columns from..to, and on columns column.. of the rows from..to.
  void from_left(Square& A, int row, int from, int to) const {
    for (int j = from; j <= to; ++j) {
      double along = 0;
      for (std::size_t k = 0; k < K; ++k) along += v[k] * A(row + static_cast<int>(k), j);
      for (std::size_t k = 0; k < K; ++k) A(row + static_cast<int>(k), j) -= beta * along * v[k];
    }
  }
  void from_right(Square& A, int column, int from, int to) const {
    for (int i = from; i <= to; ++i) {
      double along = 0;
      for (std::size_t k = 0; k < K; ++k) along += v[k] * A(i, column + static_cast<int>(k));
      for (std::size_t k = 0; k < K; ++k) A(i, column + static_cast<int>(k)) -= beta * along * v[k];
    }
  }
};

// Zeros below the first subdiagonal, from the bottom of each column up, by reflections of two neighbouring rows.
void to_hessenberg(Square& A) {
  const int last = A.size() - 1;
  for (int j = 0; j + 2 <= last; ++j) {
    for (int i = last; i >= j + 2; --i) {
      if (A(i, j) == 0) continue;
      const Reflection<2> swap({A(i - 1, j), A(i, j)});
      swap.from_left(A, i - 1, j, last);
      swap.from_right(A, i - 1, 0, last);
      A(i, j) = 0;
    }
  }
}

// One sweep over the block first..last (three rows or more) with the shifts of trace and determinant given: makes the
// bulge and chases it out.
void sweep(Square& H, int first, int last, double trace, double determinant) {
  const int p = first;
  double x = H(p, p) * H(p, p) + H(p, p + 1) * H(p + 1, p) - trace * H(p, p) + determinant;
  double y = H(p + 1, p) * (H(p, p) + H(p + 1, p + 1) - trace);
  double z = H(p + 1, p) * H(p + 2, p + 1);
  for (int k = p; k <= last - 2; ++k) {
    const Reflection<3> chase({x, y, z});
    chase.from_left(H, k, std::max(p, k - 1), last);
    chase.from_right(H, k, p, std::min(k + 3, last));
    if (k > p) H(k + 1, k - 1) = H(k + 2, k - 1) = 0;
    x = H(k + 1, k);
    y = H(k + 2, k);
    z = k + 3 <= last ? H(k + 3, k) : 0;
  }
  const Reflection<2> end({x, y});
  end.from_left(H, last - 1, last - 2, last);
  end.from_right(H, last - 1, p, last);
  H(last, last - 2) = 0;
}

// Of the 2 x 2 block that ends at i. Real ones without cancellation: the second from the product.
std::array<std::complex<double>, 2> pair_of(Square& H, int i) {
  const double a = H(i - 1, i - 1), b = H(i - 1, i), c = H(i, i - 1), d = H(i, i);
  const double half = 0.5 * (a - d), square = half * half + b * c;
  if (square < 0) {
    const double imaginary = std::sqrt(-square);
    return {{{d + half, imaginary}, {d + half, -imaginary}}};
  }
  const double z = half + std::copysign(std::sqrt(square), half);
  return {{{d + z, 0}, {z == 0 ? d : d - b * c / z, 0}}};
}

}  // namespace

std::vector<std::complex<double>> eigenvalues(std::span<const double> row_by_row, std::size_t size) {
  if (!std::all_of(row_by_row.begin(), row_by_row.end(), [](double a) { return std::isfinite(a); })) return {};
  Square H(row_by_row, size);
  balance(H);
  to_hessenberg(H);
  std::vector<std::complex<double>> found;
  found.reserve(size);
  int last = H.size() - 1;
  for (int sweeps = 0; last >= 0;) {
    int first = last;  // of the block at the end that does not fall apart
    for (; first > 0; --first) {
      const double beside = std::fabs(H(first, first)) + std::fabs(H(first - 1, first - 1));
      if (std::fabs(H(first, first - 1)) <= kEpsilon * beside) break;
    }
    if (first >= last - 1) {
      if (first == last) {
        found.emplace_back(H(last, last));
      } else {
        for (const auto& eigenvalue : pair_of(H, last)) found.push_back(eigenvalue);
      }
      last = first - 1;
      sweeps = 0;
      continue;
    }
    if (++sweeps > kSweepsPerEigenvalue) return {};
    double trace = H(last - 1, last - 1) + H(last, last);
    double determinant = H(last - 1, last - 1) * H(last, last) - H(last - 1, last) * H(last, last - 1);
    if (sweeps % 10 == 0) {  // shifts from elsewhere: a cyclic matrix is mapped onto itself by its own
      const double size_of_end = std::fabs(H(last, last - 1)) + std::fabs(H(last - 1, last - 2));
      trace = 1.5 * size_of_end;
      determinant = size_of_end * size_of_end;
    }
    sweep(H, first, last, trace, determinant);
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
