// The acts of the scene's operator on one side, in order of time.
#pragma once

#include <vector>

#include "common/station/states.hpp"
#include "proto/scene.pb.h"

namespace farhand {

class OperatorTimeline {
 public:
  OperatorTimeline(const scene::Scene& scene, Role side);

  // The act that is due at t_s, one per call. ENGAGE waits like a person who looks at the status line: until both sides
  // are ready, but no longer than engagement.timeout_s, and not beyond the next act.
  OperatorAct next(double t_s, bool both_ready) noexcept {
    if (!due(next_, t_s)) return OperatorAct::kNone;
    const Timed& timed = acts_[next_];
    if (timed.act == OperatorAct::kEngage && !both_ready && !due(next_ + 1, t_s) && t_s < timed.at_s + patience_s_)
      return OperatorAct::kNone;
    ++next_;
    return timed.act;
  }

 private:
  struct Timed {
    double at_s;
    OperatorAct act;
  };
  bool due(std::size_t k, double t_s) const noexcept { return k < acts_.size() && acts_[k].at_s <= t_s; }

  std::vector<Timed> acts_;
  double patience_s_;
  std::size_t next_ = 0;
};

}  // namespace farhand
