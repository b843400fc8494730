// Solves the few linear equations of an implicit step: LU with row pivots, of fixed size.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "common/integrate/plant.hpp"

namespace farhand {

template <std::size_t kStates>
class Lu {
 public:
  // Factors I - a J; false if it is singular or not a number.
  bool factor(double a, const StateMatrix<kStates>& J) noexcept {
    for (std::size_t i = 0; i < kStates; ++i)
      for (std::size_t j = 0; j < kStates; ++j) m_[i][j] = (i == j ? 1.0 : 0.0) - a * J[i][j];
    for (std::size_t j = 0; j < kStates; ++j) {
      std::size_t pivot = j;
      for (std::size_t i = j + 1; i < kStates; ++i)
        if (std::fabs(m_[i][j]) > std::fabs(m_[pivot][j])) pivot = i;
      pivot_[j] = pivot;
      std::swap(m_[j], m_[pivot]);
      if (!(std::fabs(m_[j][j]) > 0) || !std::isfinite(m_[j][j])) return false;
      inverse_[j] = 1.0 / m_[j][j];
      for (std::size_t i = j + 1; i < kStates; ++i) {
        const double factor = m_[i][j] *= inverse_[j];
        for (std::size_t k = j + 1; k < kStates; ++k) m_[i][k] -= factor * m_[j][k];
      }
    }
    return true;
  }

  void solve(std::array<double, kStates>& b) const noexcept {
    for (std::size_t j = 0; j < kStates; ++j) std::swap(b[j], b[pivot_[j]]);
    for (std::size_t i = 1; i < kStates; ++i)
      for (std::size_t j = 0; j < i; ++j) b[i] -= m_[i][j] * b[j];
    for (std::size_t i = kStates; i-- > 0;) {
      for (std::size_t j = i + 1; j < kStates; ++j) b[i] -= m_[i][j] * b[j];
      b[i] *= inverse_[i];
    }
  }

 private:
  StateMatrix<kStates> m_{};
  std::array<double, kStates> inverse_{};  // of the diagonal
  std::array<std::size_t, kStates> pivot_{};
};

}  // namespace farhand
