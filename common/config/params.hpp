// From a checked scene to the constants of the blocks: the only place where a setting gets its meaning in code.
#pragma once

#include <vector>

#include "common/plant/direct_slave_world.hpp"
#include "common/plant/master_world.hpp"
#include "common/plant/series_elastic_world.hpp"
#include "common/scene/station.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// The scene must be complete, as load_scene returns it.
StationParams master_station_params(const scene::Scene& scene, std::uint32_t session);
StationParams slave_station_params(const scene::Scene& scene, std::uint32_t session);

MasterWorld::Params master_world_params(const scene::Scene& scene);
DirectSlaveWorld::Params direct_slave_world_params(const scene::Scene& scene);
SeriesElasticWorld::Params series_elastic_world_params(const scene::Scene& scene);

Nanoseconds tick_of(const scene::Scene& scene);

// What the scene's operator does, in order of time.
class OperatorTimeline {
 public:
  explicit OperatorTimeline(const scene::Scene& scene);

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
