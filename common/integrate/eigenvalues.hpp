// Eigenvalues of a small real matrix.
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace farhand {

// Eigenvalues of a square matrix given row by row, after balancing. Empty if an entry is not finite or the iteration
// does not end.
std::vector<std::complex<double>> eigenvalues(std::span<const double> row_by_row, std::size_t size);

// The eigenvalue of largest modulus; infinite if they cannot be computed, 0 for an empty matrix.
std::complex<double> fastest_eigenvalue(std::span<const double> row_by_row, std::size_t size);

}  // namespace farhand
