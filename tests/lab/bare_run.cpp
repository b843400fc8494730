#include "tests/lab/bare_run.hpp"

#include "tests/lab/bare_side.hpp"

namespace farhand {
namespace {

// As BareLoop takes a side.
template <class T>
class AnySide {
 public:
  using Real = T;
  explicit AnySide(std::unique_ptr<BareSide<T>> side) : side_(std::move(side)) {}
  Sent<T> step(const Sent<T>& received, double t0, double t1) noexcept { return side_->step(received, t0, t1); }
  BareTruth truth() const noexcept { return side_->truth(); }

 private:
  std::unique_ptr<BareSide<T>> side_;
};

template <class T>
class RunOf final : public BareRun {
 public:
  RunOf(const scene::Scene& scene, const BareChoice& choice)
      : loop_(AnySide<T>(make_bare_master<T>(scene, choice)), AnySide<T>(make_bare_slave<T>(scene, choice)),
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

  BareLoop<AnySide<T>, AnySide<T>> loop_;
};

void make_ideal(scene::Scene& scene) {
  for (scene::Motor* motor : {scene.mutable_master()->mutable_motor(), scene.mutable_slave()->mutable_motor()})
    motor->set_encoder_counts_per_rev(0);
  scene.mutable_slave()->mutable_series_elastic()->set_joint_counts_per_rev(0);
  scene.mutable_slave()->mutable_series_elastic()->set_motor_counts_per_rev(0);
}

}  // namespace

std::unique_ptr<BareRun> make_bare_run(const scene::Scene& scene, const BareChoice& choice, bool ideal) {
  scene::Scene used = scene;
  if (ideal) make_ideal(used);
  if (choice.method == BareMethod::kClosedFormLong) return std::make_unique<RunOf<long double>>(used, choice);
  return std::make_unique<RunOf<double>>(used, choice);
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
