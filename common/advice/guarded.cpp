#include "common/advice/guarded.hpp"

#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"

namespace farhand {
namespace {

constexpr double kLongestTick = 0.005;    // s
constexpr double kSlowestReaction = 50;   // rad/s
constexpr double kSlowestVelocity = 200;  // rad/s
constexpr double kWeakestSpring = 5;      // rad/s per N m, with a motor of 4 rad/s

}  // namespace

std::vector<Complaint> unguarded_settings(const scene::Scene& scene) {
  std::vector<Complaint> all;
  const auto say = [&](const std::string& path, double value, const std::string& bound, const std::string& unit) {
    all.push_back({path, path + " = " + shortest(value) + " " + unit + ": the limits at the two persons hold " + bound +
                             " " + unit});
  };
  const scene::Control& c = scene.control();
  if (scene.tick_s() > kLongestTick) say("tick_s", scene.tick_s(), "up to " + shortest(kLongestTick), "s");
  if (c.g_reac_rad_s() < kSlowestReaction)
    say("control.g_reac_rad_s", c.g_reac_rad_s(), "from " + shortest(kSlowestReaction), "rad/s");
  if (c.g_v_rad_s() < kSlowestVelocity)
    say("control.g_v_rad_s", c.g_v_rad_s(), "from " + shortest(kSlowestVelocity), "rad/s");
  const auto& mcu = scene.slave().mcu();
  if (is_elastic(scene) && mcu.spring_gain_per_s() < kWeakestSpring)
    say("slave.mcu.spring_gain_per_s", mcu.spring_gain_per_s(), "from " + shortest(kWeakestSpring), "rad/s per N m");
  return all;
}

void refuse_unguarded(const scene::Scene& scene) { refuse(unguarded_settings(scene)); }

}  // namespace farhand
