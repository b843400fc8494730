// The scripted operator.
#include "common/config/operator_timeline.hpp"

#include <gtest/gtest.h>

#include "common/config/load.hpp"

namespace farhand {
namespace {

// ENGAGE waits for both sides to be ready; the others are done when they are due.
TEST(OperatorTimeline, EngagesLikeAPersonWhoLooksFirst) {
  scene::Scene scene = load_scene("demo", {}).scene;
  scene.clear_operator_acts();
  const auto add = [&](double at_s, scene::Act act) {
    scene.add_operator_acts()->set_at_s(at_s);
    scene.mutable_operator_acts()->rbegin()->set_act(act);
    scene.mutable_operator_acts()->rbegin()->set_by(scene::THERAPIST);
  };
  add(1, scene::ENGAGE), add(2, scene::HOLD), add(3, scene::ENGAGE);
  OperatorTimeline timeline(scene, Role::kLeader);
  const double patience = scene.engagement().timeout_s();
  EXPECT_EQ(timeline.next(0.999, true), OperatorAct::kNone);
  EXPECT_EQ(timeline.next(1.0, false), OperatorAct::kNone);
  EXPECT_EQ(timeline.next(1.4, true), OperatorAct::kEngage);
  EXPECT_EQ(timeline.next(1.5, true), OperatorAct::kNone);
  EXPECT_EQ(timeline.next(2.0, false), OperatorAct::kHold);
  EXPECT_EQ(timeline.next(3.0 + 0.999 * patience, false), OperatorAct::kNone);
  EXPECT_EQ(timeline.next(3.0 + patience, false), OperatorAct::kEngage);
  EXPECT_EQ(timeline.next(1e9, true), OperatorAct::kNone);

  OperatorTimeline overtaken(scene, Role::kLeader);
  EXPECT_EQ(overtaken.next(2.0, false), OperatorAct::kEngage);
  EXPECT_EQ(overtaken.next(2.0, false), OperatorAct::kHold);
}

}  // namespace
}  // namespace farhand
