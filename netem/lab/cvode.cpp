#include "netem/lab/cvode.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <vector>

namespace farhand {

struct CvodeCore::Memory {
  Problem problem;
  SUNContext context = nullptr;
  N_Vector x = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  void* cvode = nullptr;
  std::vector<int> roots;

  ~Memory() {
    if (cvode) CVodeFree(&cvode);
    if (solver) SUNLinSolFree(solver);
    if (matrix) SUNMatDestroy(matrix);
    if (x) N_VDestroy(x);
    if (context) SUNContext_Free(&context);
  }
};

namespace {

template <class Memory>
int derivative_of(double t, N_Vector x, N_Vector dx, void* data) {
  const auto& problem = static_cast<Memory*>(data)->problem;
  problem.derivative(problem.self, t, N_VGetArrayPointer(x), N_VGetArrayPointer(dx));
  return 0;
}

template <class Memory>
int jacobian_of(double t, N_Vector x, N_Vector, SUNMatrix matrix, void* data, N_Vector, N_Vector, N_Vector) {
  const auto& problem = static_cast<Memory*>(data)->problem;
  problem.jacobian(problem.self, t, N_VGetArrayPointer(x), SUNDenseMatrix_Data(matrix));
  return 0;
}

template <class Memory>
int guards_of(double t, N_Vector x, double* g, void* data) {
  const auto& problem = static_cast<Memory*>(data)->problem;
  problem.guards(problem.self, t, N_VGetArrayPointer(x), g);
  return 0;
}

void require(int flag, const char* what) {
  if (flag < 0) throw std::runtime_error(std::string("CVODE: ") + what + " failed with " + std::to_string(flag));
}

}  // namespace

bool has_cvode() noexcept { return true; }

CvodeCore::CvodeCore(CvodeMethod method, double rtol, double atol, std::size_t states, std::size_t guards,
                     const Problem& problem)
    : memory_(std::make_unique<Memory>()) {
  Memory& m = *memory_;
  m.problem = problem;
  m.roots.resize(guards);
  require(SUNContext_Create(nullptr, &m.context), "context");
  const auto n = static_cast<sunindextype>(states);
  m.x = N_VNew_Serial(n, m.context);
  m.matrix = SUNDenseMatrix(n, n, m.context);
  m.solver = SUNLinSol_Dense(m.x, m.matrix, m.context);
  m.cvode = CVodeCreate(method == CvodeMethod::kBdf ? CV_BDF : CV_ADAMS, m.context);
  N_VConst(0.0, m.x);
  require(CVodeInit(m.cvode, &derivative_of<Memory>, 0.0, m.x), "start");
  require(CVodeSetUserData(m.cvode, &m), "user data");
  require(CVodeSStolerances(m.cvode, rtol, atol), "tolerances");
  require(CVodeSetLinearSolver(m.cvode, m.solver, m.matrix), "linear solver");
  require(CVodeSetJacFn(m.cvode, &jacobian_of<Memory>), "Jacobian");
  if (guards > 0) {
    require(CVodeRootInit(m.cvode, static_cast<int>(guards), &guards_of<Memory>), "root functions");
    std::vector<int> falling(guards, -1);
    require(CVodeSetRootDirection(m.cvode, falling.data()), "root directions");
    require(CVodeSetNoInactiveRootWarn(m.cvode), "root warnings");
  }
  require(CVodeSetMaxNumSteps(m.cvode, 1'000'000), "step limit");
  require(CVodeSetErrHandlerFn(
              m.cvode, [](int, const char*, const char*, char*, void*) {}, nullptr),
          "error handler");
}

CvodeCore::~CvodeCore() = default;

double* CvodeCore::state() noexcept { return N_VGetArrayPointer(memory_->x); }

void CvodeCore::restart(double t) noexcept { CVodeReInit(memory_->cvode, t, memory_->x); }

bool CvodeCore::run(double t1, double& t, int& guard) noexcept {
  Memory& m = *memory_;
  guard = -1;
  if (CVodeSetStopTime(m.cvode, t1) < 0) return false;
  const int flag = CVode(m.cvode, t1, m.x, &t, CV_NORMAL);
  long steps = 0, derivatives = 0;
  CVodeGetNumSteps(m.cvode, &steps);
  CVodeGetNumRhsEvals(m.cvode, &derivatives);
  steps_ += static_cast<std::uint64_t>(steps);
  derivatives_ += static_cast<std::uint64_t>(derivatives);
  if (flag == CV_TOO_CLOSE) {  // less than rounding lies between t and t1
    t = t1;
    return true;
  }
  if (flag == CV_ROOT_RETURN && CVodeGetRootInfo(m.cvode, m.roots.data()) == CV_SUCCESS) {
    for (std::size_t k = 0; k < m.roots.size() && guard < 0; ++k)
      if (m.roots[k] != 0) guard = static_cast<int>(k);
  }
  return flag >= 0;
}

}  // namespace farhand
