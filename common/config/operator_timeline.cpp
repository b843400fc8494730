#include "common/config/operator_timeline.hpp"

namespace farhand {
namespace {

OperatorAct act_of(scene::Act act) {
  switch (act) {
    case scene::ENGAGE:
      return OperatorAct::kEngage;
    case scene::HOLD:
      return OperatorAct::kHold;
    case scene::STOP:
      return OperatorAct::kStop;
    case scene::RESET:
      return OperatorAct::kReset;
    case scene::HOME:
      return OperatorAct::kHome;
    case scene::IDENTIFY:
      return OperatorAct::kIdentify;
    case scene::SWEEP:
      return OperatorAct::kSweep;
    default:
      break;
  }
  return OperatorAct::kNone;
}

}  // namespace

OperatorTimeline::OperatorTimeline(const scene::Scene& scene, Role side) : patience_s_(scene.engagement().timeout_s()) {
  const scene::Person person = side == Role::kLeader ? scene::THERAPIST : scene::PATIENT;
  for (const scene::OperatorAct& timed : scene.operator_acts()) {
    if (timed.by() == person) acts_.push_back({timed.at_s(), act_of(timed.act())});
  }
}

}  // namespace farhand
