#include "netem/lab/bare_run.hpp"

#include <cmath>
#include <concepts>
#include <stdexcept>

#include "common/config/scene_kind.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "netem/lab/bare_loop.hpp"
#include "netem/lab/bare_orthosis.hpp"
#include "netem/lab/bare_plant.hpp"
#include "netem/lab/host_stalls.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

// A motor that takes a torque: master, or slave with a direct drive.
template <class T>
class DirectSide {
 public:
  using Real = T;
  DirectSide(std::unique_ptr<BareLaw<T>> law, std::unique_ptr<BarePlant<T>> plant)
      : law_(std::move(law)), plant_(std::move(plant)) {
    law_->reset(plant_->angle(), {plant_->angle(), T{}, T{}});
  }

  Sent<T> step(const Sent<T>& received, double /*t0*/, double t1) noexcept {
    const Sent<T> sent = law_->observe(plant_->angle());
    plant_->advance(law_->follow(received), t1);
    return sent;
  }
  BareTruth truth() const noexcept { return plant_->truth(); }

 private:
  std::unique_ptr<BareLaw<T>> law_;
  std::unique_ptr<BarePlant<T>> plant_;
};

// The orthosis: the station sends references, the loops of the MCU run at their own rate.
template <class T>
class OrthosisSide {
 public:
  using Real = T;
  OrthosisSide(const ControlParams& params, const mcu::McuSettings& loops, std::unique_ptr<BarePlant<T>> plant)
      : station_(params), law_(loops), loop_hz_(loops.loop_hz), plant_(std::move(plant)) {
    station_.reset(plant_->angle());
    law_.start(plant_->angle(), static_cast<T>(loops.spring) * (plant_->motor_angle() - plant_->angle()));
  }

  Sent<T> step(const Sent<T>& received, double t0, double t1) noexcept {
    const T x = plant_->angle();
    station_.step(x, received.x, received.v, received.f);
    const Sent<T> sent{x, station_.v, law_.f()};
    law_.follow({station_.x_ref, station_.v_ref, station_.f_ref});
    const int loops = std::max(1, static_cast<int>(std::lround((t1 - t0) * loop_hz_)));
    for (int k = 0; k < loops; ++k) {
      const double until = k + 1 == loops ? t1 : t0 + (t1 - t0) * (k + 1) / loops;
      plant_->advance(law_.step(plant_->angle(), plant_->motor_angle()), until);
    }
    return sent;
  }
  BareTruth truth() const noexcept { return plant_->truth(); }

 private:
  PlainReferenceStep<T> station_;
  OrthosisLaw<T> law_;
  double loop_hz_;
  std::unique_ptr<BarePlant<T>> plant_;
};

template <class T>
DirectSide<T> direct_side(const StationParams& params, std::unique_ptr<BarePlant<T>> plant) {
  if constexpr (std::same_as<T, double>) {
    return {make_block_law(bare_law_of(params.architecture, params.role), params.control), std::move(plant)};
  } else {
    return {make_plain_law<T>(bare_law_of(params.architecture, params.role), params.control), std::move(plant)};
  }
}

template <class T, class Slave>
class RunOf final : public BareRun {
 public:
  RunOf(const scene::Scene& scene, const BareChoice& choice, Slave slave)
      : loop_(direct_side(master_station_params(scene, 1), make_bare_master<T>(scene, choice)), std::move(slave),
              scene.tick_s(), ticks(scene.network().forward(), scene), ticks(scene.network().backward(), scene), T{}) {}

  void run(std::int64_t count) noexcept override {
    for (std::int64_t k = 0; k < count; ++k) loop_.tick();
  }
  Trajectory record(std::int64_t count) override {
    Trajectory out;
    for (auto* column : {&out.x_m, &out.x_s, &out.f_m, &out.f_s}) column->reserve(static_cast<std::size_t>(count));
    BareTruth m, s;
    for (std::int64_t k = 0; k < count; ++k) {
      loop_.tick();
      m = loop_.master().truth(), s = loop_.slave().truth();
      out.x_m.push_back(m.x), out.f_m.push_back(m.f);
      out.x_s.push_back(s.x), out.f_s.push_back(s.f);
    }
    if (m.failure != nullptr) out.failure = std::string("master: ") + m.failure;
    if (s.failure != nullptr) out.failure = std::string("slave: ") + s.failure;
    out.steps = m.steps + s.steps;
    out.events = m.events + s.events;
    return out;
  }

 private:
  static std::size_t ticks(const scene::Path& path, const scene::Scene& scene) {
    return static_cast<std::size_t>(std::lround(path.delay_s() / scene.tick_s()));
  }

  BareLoop<DirectSide<T>, Slave> loop_;
};

template <class T>
std::unique_ptr<BareRun> run_of(const scene::Scene& scene, const BareChoice& choice) {
  const StationParams params = slave_station_params(scene, 2);
  auto plant = make_bare_slave<T>(scene, choice);
  if (scene.slave().device() == scene::SERIES_ELASTIC)
    return std::make_unique<RunOf<T, OrthosisSide<T>>>(
        scene, choice, OrthosisSide<T>(params.control, emulator_params(scene).mcu, std::move(plant)));
  return std::make_unique<RunOf<T, DirectSide<T>>>(scene, choice, direct_side(params, std::move(plant)));
}

void make_ideal(scene::Scene& scene) {
  for (scene::Motor* motor : {scene.mutable_master()->mutable_motor(), scene.mutable_slave()->mutable_motor()})
    motor->set_encoder_counts_per_rev(0);
  scene.mutable_slave()->mutable_series_elastic()->set_joint_counts_per_rev(0);
  scene.mutable_slave()->mutable_series_elastic()->set_motor_counts_per_rev(0);
}

}  // namespace

std::unique_ptr<BareRun> make_bare_run(const scene::Scene& scene, const BareChoice& choice, bool ideal) {
  refuse_host_stalls(scene, "the bare loop");
  if (scale_of(scene).any())
    throw std::invalid_argument(
        "the bare loop knows sides of one size: control.position_scale and control.force_scale must be 1");
  if (scene.master().therapist().has_reaction())
    throw std::invalid_argument(
        "the bare loop knows no therapist who gives way: master.therapist.reaction must be absent");
  scene::Scene used = scene;
  if (ideal) make_ideal(used);
  return choice.method == BareMethod::kClosedFormLong ? run_of<long double>(used, choice)
                                                      : run_of<double>(used, choice);
}

std::string methods_of(const scene::Scene& scene) {
  const auto words = [](const auto& world) { return std::string(name_of(world.method())); };
  const std::string master = words(MasterWorld(master_world_params(scene), world_numerics(scene)));
  const std::string slave = scene.slave().device() == scene::SERIES_ELASTIC
                                ? words(SeriesElasticWorld(series_elastic_world_params(scene), world_numerics(scene)))
                                : words(DirectSlaveWorld(direct_slave_world_params(scene), world_numerics(scene)));
  return master == slave ? master : master + " (master), " + slave + " (slave)";
}

std::string not_affine(const scene::Scene& scene) {
  try {
    make_bare_run(scene, {BareMethod::kClosedFormLong, 0, 0});
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
  return {};
}

double hold_of(const scene::Scene& scene) {
  const bool elastic = scene.slave().device() == scene::SERIES_ELASTIC;
  return elastic ? std::min(scene.tick_s(), 1.0 / scene.slave().mcu().loop_hz()) : scene.tick_s();
}

}  // namespace farhand
