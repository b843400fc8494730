#include "common/judge/metrics.hpp"

#include <string>
#include <utility>
#include <vector>

#include "common/judge/alignment.hpp"
#include "common/judge/metric_parts.hpp"
#include "common/judge/verdict.hpp"

namespace farhand {

Metrics compute_metrics(const Session& session, const scene::Scene& scene) {
  Metrics out;
  const AlignedSession aligned = align(session, scene);
  out.set("scene", session.scene_name);
  out.set("seed", session.seed);
  out.set("force_source", std::string(aligned.true_torque ? "true" : "estimated"));
  out.set("angle_source", std::string(aligned.true_angle ? "true" : "estimated"));
  out.set("clock_offset_bound_ms", 1e3 * session.clock_offset_bound_s);
  run_metrics(session, scene, aligned, out);
  phantom_metrics(aligned, scene, out);
  free_motion_metrics(aligned, scene, out);
  contact_metrics(aligned, scene, out);
  friction_metrics(session.friction, out);
  network_metrics(session, aligned, out);
  clock_metrics(session, out);

  const Judgement judgement = judge(session, scene, out);
  out.set("verdict", std::string(name_of(judgement.verdict)));
  out.set("reasons", judgement.reasons);
  std::vector<std::string> absent;
  for (const Metric& metric : out.all()) {
    const bool missing = std::holds_alternative<std::monostate>(metric.value);
    if (missing && metric.info->deterministic && metric.info->key != "absent")
      absent.push_back(std::string(metric.info->key) + ": " + metric.absent_because);
  }
  out.set("absent", std::move(absent));
  return out;
}

}  // namespace farhand
