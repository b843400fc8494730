#include "netem/lab/sweep.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "common/advice/scene_loops.hpp"
#include "common/config/scene_kind.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "netem/lab/bare_run.hpp"
#include "netem/lab/lanes.hpp"

namespace farhand {
namespace {

constexpr double kResidual = 2.0;  // s

std::size_t delay_ticks(const scene::Path& path, double tick_s) {
  return static_cast<std::size_t>(std::lround(path.delay_s() / tick_s));
}

void describe_end(const SweepOutcome& o, SweepOutcome& out) {
  const bool finite = std::isfinite(o.x_m) && std::isfinite(o.x_s) && std::isfinite(o.f_m) && std::isfinite(o.f_s);
  if (!finite) out.failure = "diverged";
}

template <PlainScene kScene>
class LockStepOf final : public LockStep {
 public:
  explicit LockStepOf(std::span<const scene::Scene> scenes)
      : count_(scenes.size()),
        ticks_(ticks_of(scenes[0])),
        settled_(ticks_ - static_cast<std::int64_t>(kResidual / scenes[0].tick_s())),
        first_(loop_of(scenes, 0)),
        second_(loop_of(scenes, kLanes)) {}

  void run() noexcept override {
    for (std::int64_t k = 0; k < ticks_; ++k) {
      tick(first_, k >= settled_);
      tick(second_, k >= settled_);
    }
  }

  std::vector<SweepOutcome> outcomes() const override {
    std::vector<SweepOutcome> out;
    for (const Watched* w : {&first_, &second_}) {
      for (std::size_t lane = 0; lane < kLanes && out.size() < count_; ++lane) {
        SweepOutcome o{w->master.x[lane],
                       w->slave.x[lane],
                       w->master.f[lane],
                       w->slave.f[lane],
                       std::sqrt(w->sum[lane] / static_cast<double>(ticks_)),
                       w->greatest[lane] - w->least[lane],
                       {}};
        describe_end(o, o);
        out.push_back(o);
      }
    }
    return out;
  }

 private:
  using Master = LaneSide<kScene, MasterPlant>;
  using Slave = LaneSide<PlainScene::kFourChannel, DirectSlavePlant>;
  struct Watched {
    explicit Watched(BareLoop<Master, Slave> l) : loop(std::move(l)) {}
    BareLoop<Master, Slave> loop;
    Sent<Lanes> master{}, slave{};
    Lanes sum{};
    Lanes least = Lanes{} + std::numeric_limits<double>::infinity();
    Lanes greatest = Lanes{} - std::numeric_limits<double>::infinity();
  };

  static void tick(Watched& w, bool settled) noexcept {
    const Lanes shown = w.loop.at_slave().x;
    w.loop.tick();
    w.master = w.loop.master().sent();
    w.slave = w.loop.slave().sent();
    const Lanes x = w.slave.x, error = x - shown;
    w.sum += error * error;
    if (settled) {
      w.least = x < w.least ? x : w.least;
      w.greatest = x > w.greatest ? x : w.greatest;
    }
  }

  // Lanes that have no scene of their own repeat the first.
  static Watched loop_of(std::span<const scene::Scene> scenes, std::size_t from) {
    const auto of = [&](std::size_t lane) -> const scene::Scene& {
      return from + lane < scenes.size() ? scenes[from + lane] : scenes[0];
    };
    const scene::Scene &a = of(0), &b = of(1);
    return Watched(BareLoop<Master, Slave>(
        Master({master_station_params(a, 1).control, master_station_params(b, 1).control},
               {MasterPlant(master_world_params(a)), MasterPlant(master_world_params(b))},
               {a.master().motor().encoder_counts_per_rev(), b.master().motor().encoder_counts_per_rev()}),
        Slave({slave_station_params(a, 2).control, slave_station_params(b, 2).control},
              {DirectSlavePlant(direct_slave_world_params(a)), DirectSlavePlant(direct_slave_world_params(b))},
              {a.slave().motor().encoder_counts_per_rev(), b.slave().motor().encoder_counts_per_rev()}),
        a.tick_s(), delay_ticks(a.network().forward(), a.tick_s()), delay_ticks(a.network().backward(), a.tick_s()),
        Lanes{}));
  }

  std::size_t count_;
  std::int64_t ticks_, settled_;
  Watched first_, second_;
};

// Any scene, by itself, with the method that it asks for.
SweepOutcome alone(const scene::Scene& scene) {
  const std::int64_t ticks = ticks_of(scene);
  const Trajectory run = make_bare_run(scene, {BareMethod::kWorld, 0, 0}, false)->record(ticks);
  SweepOutcome out{run.x_m.back(), run.x_s.back(), run.f_m.back(), run.f_s.back(), 0, 0, run.failure};
  const std::size_t delay = std::max<std::size_t>(1, delay_ticks(scene.network().forward(), scene.tick_s()));
  const auto settled = static_cast<std::size_t>(std::max(0.0, static_cast<double>(ticks) - kResidual / scene.tick_s()));
  double least = std::numeric_limits<double>::infinity(), greatest = -least, sum = 0;
  for (std::size_t k = 0; k < run.x_s.size(); ++k) {
    const double error = run.x_s[k] - (k >= delay ? run.x_m[k - delay] : run.x_m.front());
    sum += error * error;
    if (k >= settled) least = std::min(least, run.x_s[k]), greatest = std::max(greatest, run.x_s[k]);
  }
  out.tracking_rms = std::sqrt(sum / static_cast<double>(ticks));
  out.residual = greatest - least;
  if (out.failure.empty()) describe_end(out, out);
  return out;
}

}  // namespace

bool LockStep::suits(const scene::Scene& scene) {
  if (scene.master().has_host() || scene.slave().has_host()) return false;  // refused by the bare loop
  const auto plain = [](const scene::Motor& m) {
    return !(m.coulomb_nm() > 0) && !m.has_lugre() && !(m.gravity_nm() > 0);
  };
  const scene::Method method = scene.world().method();
  // People who act by themselves: a hand that relaxes is not affine, and lanes of the others would rarely go together.
  const scene::Hand& hand = scene.slave().hand();
  if (hand.rest_amplitude_rad() > 0 || hand.tremor_nm() > 0 || hand.has_relaxed_nm_per_rad() ||
      hand.spastic_nms_per_rad() > 0 || scene.master().therapist().has_reaction())
    return false;
  return joined_by_four_channels(scene) && !scale_of(scene).any() && scene.slave().device() == scene::DIRECT_DRIVE &&
         plain(scene.master().motor()) && plain(scene.slave().motor()) &&
         (method == scene::AUTO || method == scene::CLOSED_FORM);
}

bool LockStep::together(const scene::Scene& a, const scene::Scene& b) {
  const auto delays = [](const scene::Scene& s) {
    return std::pair(delay_ticks(s.network().forward(), s.tick_s()), delay_ticks(s.network().backward(), s.tick_s()));
  };
  return a.architecture() == b.architecture() && ticks_of(a) == ticks_of(b) && a.tick_s() == b.tick_s() &&
         delays(a) == delays(b);
}

std::unique_ptr<LockStep> make_lock_step(std::span<const scene::Scene> scenes) {
  if (scenes[0].architecture() == scene::FOUR_CHANNEL_CDOB)
    return std::make_unique<LockStepOf<PlainScene::kCdob>>(scenes);
  if (scenes[0].architecture() == scene::FOUR_CHANNEL_CDOB_SDCV)
    return std::make_unique<LockStepOf<PlainScene::kCdobSdcv>>(scenes);
  return std::make_unique<LockStepOf<PlainScene::kFourChannel>>(scenes);
}

std::vector<SweepOutcome> sweep(std::size_t count, const std::function<scene::Scene(std::size_t)>& scene_of,
                                const Workload& work) {
  std::vector<SweepOutcome> outcomes(count);
  const std::size_t groups = (count + LockStep::kScenes - 1) / LockStep::kScenes;  // of neighbours
  std::atomic<std::size_t> begun{0};
  const bool all = work.each_of(count, groups, [&](std::size_t group) {
    ++begun;
    const std::size_t from = group * LockStep::kScenes;
    std::vector<scene::Scene> scenes;
    for (std::size_t k = from; k < std::min(count, from + LockStep::kScenes); ++k) scenes.push_back(scene_of(k));
    const bool lockstep = std::all_of(scenes.begin(), scenes.end(), [&](const scene::Scene& s) {
      return LockStep::suits(s) && LockStep::together(scenes.front(), s);
    });
    if (lockstep) {
      const auto run = make_lock_step(scenes);
      run->run();
      std::ranges::copy(run->outcomes(), outcomes.begin() + static_cast<std::ptrdiff_t>(from));
    } else {
      std::ranges::transform(scenes, outcomes.begin() + static_cast<std::ptrdiff_t>(from), alone);
    }
    for (std::size_t k = 0; k < scenes.size(); ++k) work.done_one();
  });
  if (!all) outcomes.resize(std::min(count, LockStep::kScenes * begun));
  return outcomes;
}

}  // namespace farhand
