// Least squares whose confidence intervals are valid although errors are not independent from row to row (those of a
// quantised encoder are not). Rows come in blocks that are independent. The blocks are left out one after the other,
// and the scatter of the results gives the interval (delete-one jackknife, Student's t). Memory is fixed: when all
// blocks are used, neighbours are merged.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/identify/student.hpp"

namespace farhand {

template <int P>
class BlockedLeastSquares {
 public:
  using Row = Eigen::Matrix<double, P, 1>;
  static constexpr int kBlocks = 96;
  static constexpr int kFewestBlocks = 6;

  struct Solution {
    bool determined = false;  // enough blocks, and the rows determine all parameters
    Row value = Row::Zero();
    Row half_width = Row::Zero();  // of the interval of 95 %
    double residual = 0.0;         // RMS of the part of y that the fit leaves
    double spread = 0.0;           // RMS of y
    int rows = 0, blocks = 0;
  };

  // y = row * parameters + error.
  void add(const Row& row, double y) noexcept {
    Sums& sums = blocks_[used_];
    sums.gram += row * row.transpose();
    sums.moment += y * row;
    sums.square += y * y;
    ++sums.rows;
  }

  // The next row belongs to another block.
  void close() noexcept {
    if (blocks_[used_].rows == 0 || ++parts_ < parts_per_block_) return;
    parts_ = 0;
    if (++used_ < kBlocks) return;
    used_ /= 2;
    parts_per_block_ *= 2;
    for (int i = 0; i < kBlocks; ++i) {
      const Sums merged = i < used_ ? blocks_[2 * i] + blocks_[2 * i + 1] : Sums{};
      blocks_[i] = merged;
    }
  }

  Solution solve() const noexcept {
    Sums all;
    Solution s;
    for (const Sums& block : blocks_) {
      all = all + block;
      s.blocks += block.rows > 0;
    }
    s.rows = all.rows;
    if (s.rows <= P || s.blocks < kFewestBlocks || !told_apart(all.gram)) return s;
    s.determined = true;
    s.value = solved(all);
    const double left = all.square - s.value.dot(2.0 * all.moment - all.gram * s.value);
    s.residual = std::sqrt(std::max(left, 0.0) / (s.rows - P));
    s.spread = std::sqrt(all.square / s.rows);
    Row mean = Row::Zero();
    for (const Sums& block : blocks_) mean += without(all, block, s.value) / s.blocks;
    Row square = Row::Zero(), fourth = Row::Zero();
    for (const Sums& block : blocks_) {
      if (block.rows == 0) continue;
      const Row apart = (without(all, block, s.value) - mean).cwiseAbs2();
      square += apart;
      fourth += apart.cwiseAbs2();
    }
    for (int i = 0; i < P; ++i) {
      // Blocks with little information on a parameter add little to the degrees of freedom of its scatter
      // (Satterthwaite; for a normal distribution the mean fourth power is three times the square of the variance).
      const double freedom = 3.0 * square[i] * square[i] / fourth[i];
      const int n = std::isfinite(freedom) ? std::clamp(static_cast<int>(freedom), 1, s.blocks - 1) : 1;
      s.half_width[i] = student_975(n) * std::sqrt(square[i] * (s.blocks - 1.0) / s.blocks);
    }
    return s;
  }

 private:
  using Gram = Eigen::Matrix<double, P, P>;
  struct Sums {
    Gram gram = Gram::Zero();
    Row moment = Row::Zero();
    double square = 0.0;
    int rows = 0;

    Sums operator+(const Sums& o) const noexcept { return with(o, 1); }
    Sums operator-(const Sums& o) const noexcept { return with(o, -1); }
    Sums with(const Sums& o, int sign) const noexcept {
      Sums sum;
      sum.gram = gram + sign * o.gram;
      sum.moment = moment + sign * o.moment;
      sum.square = square + sign * o.square;
      sum.rows = rows + sign * o.rows;
      return sum;
    }
  };

  // Change of the result when a block is left out. It is computed as a difference, because it is too small to be found
  // by subtracting two results.
  static Row without(const Sums& all, const Sums& block, const Row& value) noexcept {
    return block.rows > 0 ? Row(solved(all - block) - value) : Row(Row::Zero());
  }
  // Solves with columns scaled to length 1, so that units do not matter.
  static Row solved(const Sums& sums) noexcept {
    const Row scale = sums.gram.diagonal().cwiseSqrt().cwiseInverse();
    const Gram g = scale.asDiagonal() * sums.gram * scale.asDiagonal();
    return scale.cwiseProduct(g.ldlt().solve(scale.cwiseProduct(sums.moment)));
  }
  static bool told_apart(const Gram& gram) noexcept {
    if (!(gram.diagonal().minCoeff() > 0.0) || !gram.allFinite()) return false;
    const Row scale = gram.diagonal().cwiseSqrt().cwiseInverse();
    const Gram g = scale.asDiagonal() * gram * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Gram>(g, Eigen::EigenvaluesOnly).eigenvalues()[0] > kSmallest;
  }

  static constexpr double kSmallest = 1e-4;  // eigenvalue of columns of length 1: 100 times the error of one alone

  std::array<Sums, kBlocks> blocks_{};
  int used_ = 0, parts_ = 0, parts_per_block_ = 1;
};

}  // namespace farhand
