// What the scene's people do on one side, in order of time.
#pragma once

#include <vector>

#include "common/scene/states.hpp"
#include "proto/scene.pb.h"

namespace farhand {

class OperatorTimeline {
 public:
  OperatorTimeline(const scene::Scene& scene, Role side);

  // The act that is due at t_s, one per call.
  OperatorAct next(double t_s) noexcept {
    return next_ < acts_.size() && acts_[next_].at_s <= t_s ? acts_[next_++].act : OperatorAct::kNone;
  }

 private:
  struct Timed {
    double at_s;
    OperatorAct act;
  };
  std::vector<Timed> acts_;
  std::size_t next_ = 0;
};

}  // namespace farhand
