// CVODE of SUNDIALS behind the interface of our own integrators: for comparison of error and time, and as a second
// reference. It uses dense Newton with the plant's own Jacobian, and the guards as root functions. The held input jumps
// at every advance, so that each advance starts the multistep method anew.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/integrate/method.hpp"
#include "common/integrate/plant.hpp"

namespace farhand {

enum class CvodeMethod { kBdf, kAdams };

bool has_cvode() noexcept;  // false: built without CVODE, and a core throws

// The library, without knowing any plant.
class CvodeCore {
 public:
  // Functions of the plant that CVODE calls; `self` is passed to them.
  struct Problem {
    void* self;
    void (*derivative)(void* self, double t, const double* x, double* dx);
    void (*jacobian)(void* self, double t, const double* x, double* column_major);
    void (*guards)(void* self, double t, const double* x, double* g);
  };

  // Throws std::runtime_error if CVODE refuses.
  CvodeCore(CvodeMethod method, double rtol, double atol, std::size_t states, std::size_t guards,
            const Problem& problem);
  ~CvodeCore();
  CvodeCore(const CvodeCore&) = delete;
  CvodeCore& operator=(const CvodeCore&) = delete;

  double* state() noexcept;
  void restart(double t) noexcept;
  // Runs to t1 or to the first guard that falls to zero; `guard` is then its number, else -1. Returns false if CVODE
  // fails.
  bool run(double t1, double& t, int& guard) noexcept;
  std::uint64_t steps() const noexcept { return steps_; }
  std::uint64_t derivatives() const noexcept { return derivatives_; }

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
  std::uint64_t steps_ = 0, derivatives_ = 0;
};

template <Plant P>
class CvodeIntegrator {
 public:
  using State = typename P::State;

  CvodeIntegrator(CvodeMethod method, double rtol, double atol) : method_(method), rtol_(rtol), atol_(atol) {}

  void start(const P& plant, double t, const State& x) {
    task_ = std::make_unique<Task>();
    task_->plant = &plant;
    core_ = std::make_unique<CvodeCore>(method_, rtol_, atol_, P::kStates, P::kGuards,
                                        CvodeCore::Problem{task_.get(), &derivative, &jacobian, &guards});
    t_ = t;
    x_ = x;
    task_->mode = plant.mode_at(t, x);
  }

  void advance(const P& plant, double t1) noexcept {
    task_->plant = &plant;
    int in_place = 0;
    settle();
    while (good_ && t_ < t1) {
      const double next = plant.next_break(t_), until = std::min(t1, next);
      std::copy(x_.begin(), x_.end(), core_->state());
      core_->restart(t_);
      int guard = -1;
      const double before = t_;
      good_ = core_->run(until, t_, guard);
      std::copy_n(core_->state(), P::kStates, x_.begin());
      if (guard >= 0) {
        ++events_;
        task_->mode = plant.cross(task_->mode, static_cast<std::size_t>(guard), t_, x_);
        in_place = t_ > before ? 0 : in_place + 1;
        good_ = good_ && in_place < 50;
      } else if (t_ >= next) {
        task_->mode = plant.mode_at(t_, x_);
      }
    }
  }

  const State& state() const noexcept { return x_; }
  Mode mode() const noexcept { return task_->mode; }
  double time() const noexcept { return t_; }
  IntegratorStatus status() const noexcept { return good_ ? IntegratorStatus::kOk : IntegratorStatus::kDiverged; }
  IntegratorCounters counters() const noexcept {
    IntegratorCounters out;
    out.events = events_;
    if (core_) out.steps = core_->steps(), out.derivatives = core_->derivatives();
    return out;
  }

 private:
  // A jump of the held input may have ended the mode at once, but root functions only detect a change of sign.
  void settle() noexcept {
    for (int round = 0; round < 8; ++round) {
      const auto all = task_->plant->guards(task_->mode, t_, x_);
      const auto ended = std::find_if(all.begin(), all.end(), [](double g) { return g < 0; });
      if (ended == all.end()) return;
      task_->mode = task_->plant->cross(task_->mode, static_cast<std::size_t>(ended - all.begin()), t_, x_);
    }
  }
  // Kept at an address that does not change when the integrator object is moved.
  struct Task {
    const P* plant;
    Mode mode;
  };

  static State state_of(const double* x) noexcept {
    State s;
    std::copy_n(x, P::kStates, s.begin());
    return s;
  }
  static void derivative(void* self, double t, const double* x, double* dx) {
    const Task& task = *static_cast<Task*>(self);
    const State slope = task.plant->derivative(task.mode, t, state_of(x));
    std::copy(slope.begin(), slope.end(), dx);
  }
  static void jacobian(void* self, double t, const double* x, double* column_major) {
    const Task& task = *static_cast<Task*>(self);
    const auto rows = task.plant->jacobian(task.mode, t, state_of(x));
    for (std::size_t i = 0; i < P::kStates; ++i)
      for (std::size_t j = 0; j < P::kStates; ++j) column_major[j * P::kStates + i] = rows[i][j];
  }
  static void guards(void* self, double t, const double* x, double* g) {
    const Task& task = *static_cast<Task*>(self);
    const auto all = task.plant->guards(task.mode, t, state_of(x));
    std::copy(all.begin(), all.end(), g);
  }

  CvodeMethod method_;
  double rtol_, atol_;
  std::unique_ptr<Task> task_;
  std::unique_ptr<CvodeCore> core_;
  double t_ = 0;
  State x_{};
  std::uint64_t events_ = 0;
  bool good_ = true;
};

}  // namespace farhand
