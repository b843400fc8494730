// A simulated world: a plant, its state, and the method that advances it. The kind of friction and the method are
// chosen when the world is made; parts that a scene does not use are not in it.
#pragma once

#include <memory>

#include "common/integrate/method.hpp"
#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"

namespace farhand {

struct WorldNumerics {
  Method method = Method::kAuto;
  IntegratorSettings settings = {};
  bool even_if_unstable = false;  // an explicit method may step beyond its limit, only to show the result
};

// A plant of one friction under one method.
template <class Truth>
class WorldEngine {
 public:
  virtual ~WorldEngine() = default;
  virtual void advance(double input, double t1_s) noexcept = 0;
  virtual Truth truth() const noexcept = 0;
  virtual double encoder() const noexcept = 0;
  virtual double motor_encoder() const noexcept = 0;  // the joint's if there is no other
  virtual double stored_energy() const noexcept = 0;
  virtual PowerFlow power() const noexcept = 0;
  virtual Method method() const noexcept = 0;
  virtual const MethodChoice& choice() const noexcept = 0;
  virtual IntegratorCounters counters() const noexcept = 0;
  virtual IntegratorStatus status() const noexcept = 0;
};

// Throw std::invalid_argument, with the reason in words, if the method cannot advance this plant.
std::unique_ptr<WorldEngine<MasterPlant::Truth>> make_engine(const MasterPlant::Params&, const WorldNumerics&);
std::unique_ptr<WorldEngine<DirectSlavePlant::Truth>> make_engine(const DirectSlavePlant::Params&,
                                                                  const WorldNumerics&);
std::unique_ptr<WorldEngine<SeriesElasticPlant::Truth>> make_engine(const SeriesElasticPlant::Params&,
                                                                    const WorldNumerics&);

// P: the plant without friction, which stands for its whole family. Time starts at 0 s.
template <class P>
class World {
 public:
  using Params = typename P::Params;
  using Truth = typename P::Truth;

  // Throws std::invalid_argument as make_engine does.
  explicit World(const Params& params, const WorldNumerics& numerics = {}) : engine_(make_engine(params, numerics)) {}

  // The input (N m of the motor, rad/s of a velocity-sourced motor) is held from the end of the last advance to t1_s.
  void advance(double input, double t1_s) noexcept { engine_->advance(input, t1_s); }

  // True values at the end of the last advance, under its input.
  Truth truth() const noexcept { return engine_->truth(); }
  double true_x() const noexcept { return truth().x; }
  double true_v() const noexcept { return truth().v; }
  // Torque of the person (or hand and wall) against the device: positive if the slave presses in the positive
  // direction, negative if the therapist pushes in the positive direction.
  double true_f() const noexcept { return truth().f; }
  double encoder() const noexcept { return engine_->encoder(); }
  double motor_encoder() const noexcept { return engine_->motor_encoder(); }
  double stored_energy() const noexcept { return engine_->stored_energy(); }  // J
  PowerFlow power() const noexcept { return engine_->power(); }

  Method method() const noexcept { return engine_->method(); }  // never kAuto
  // The method that AUTO chooses here, and why, whatever method runs.
  const MethodChoice& choice() const noexcept { return engine_->choice(); }
  IntegratorCounters counters() const noexcept { return engine_->counters(); }
  IntegratorStatus status() const noexcept { return engine_->status(); }

 private:
  std::unique_ptr<WorldEngine<Truth>> engine_;
};

using MasterWorld = World<MasterPlant>;
using DirectSlaveWorld = World<DirectSlavePlant>;
using SeriesElasticWorld = World<SeriesElasticPlant>;

}  // namespace farhand
