// Many scenes on all cores: four at a time in lockstep where their plants allow it, each by itself where not. What
// comes out does not depend on the number of threads, nor on which scenes ran side by side.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "netem/lab/workload.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// In the bare loop: a constant delay of whole ticks, engaged from the start.
struct SweepOutcome {
  double x_m = 0, x_s = 0, f_m = 0, f_s = 0;  // rad, N m: as the sides say it themselves, at the last tick
  double tracking_rms = 0;                    // rad, slave against the master as received
  double residual = 0;                        // rad, from least to greatest x_s of the last 2 s
  std::string failure;                        // empty: ran to its end

  bool operator==(const SweepOutcome&) const = default;
};

// Scenes that run in lockstep, made ready: run() neither allocates nor throws.
class LockStep {
 public:
  virtual ~LockStep() = default;
  virtual void run() noexcept = 0;
  virtual std::vector<SweepOutcome> outcomes() const = 0;

  static constexpr std::size_t kScenes = 4;
  // What may differ between them: everything but architecture, length, control period and delays.
  static bool suits(const scene::Scene& scene);
  static bool together(const scene::Scene& a, const scene::Scene& b);
};

// 1 to LockStep::kScenes complete scenes that suit and go together.
std::unique_ptr<LockStep> make_lock_step(std::span<const scene::Scene> scenes);

// scene_of(k): the complete scene k of `count`; called from any thread. Fewer outcomes, the first ones, where a signal
// ended the work.
std::vector<SweepOutcome> sweep(std::size_t count, const std::function<scene::Scene(std::size_t)>& scene_of,
                                const Workload& work);

}  // namespace farhand
