#include "common/config/operator_timeline.hpp"

namespace farhand {

OperatorTimeline::OperatorTimeline(const scene::Scene& scene) {
  for (const scene::OperatorAct& timed : scene.operator_acts()) {
    const OperatorAct act = timed.act() == scene::ENGAGE ? OperatorAct::kEngage
                            : timed.act() == scene::HOLD ? OperatorAct::kHold
                                                         : OperatorAct::kStop;
    acts_.push_back({timed.at_s(), act});
  }
}

}  // namespace farhand
