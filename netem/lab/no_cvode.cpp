// In place of cvode.cpp where SUNDIALS was not found.
#include <cstdlib>

#include "netem/lab/cvode.hpp"

namespace farhand {

struct CvodeCore::Memory {};

bool has_cvode() noexcept { return false; }

CvodeCore::CvodeCore(CvodeMethod, double, double, std::size_t, std::size_t, const Problem&) {
  throw std::runtime_error("this program was built without CVODE");
}
CvodeCore::~CvodeCore() = default;

// There is none.
double* CvodeCore::state() noexcept { std::abort(); }
void CvodeCore::restart(double) noexcept { std::abort(); }
bool CvodeCore::run(double, double&, int&) noexcept { std::abort(); }

}  // namespace farhand
