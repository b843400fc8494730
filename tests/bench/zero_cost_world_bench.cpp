// As zero_cost_bench.cpp does with stations: the run without its recorder and its network, the plant without what it
// would touch.
#include "common/config/operator_timeline.hpp"
#include "common/config/world_params.hpp"
#include "common/integrate/closed_form.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/link/codec.hpp"
#include "common/plant/axis_plant.hpp"
#include "netem/link_params.hpp"
#include "netem/pending.hpp"
#include "tests/bench/paired.hpp"

namespace farhand {
namespace {

// What the lab's run is made of, by hand and with no place for anybody who watches. Its clocks are one.
class UnwatchedRun {
 public:
  explicit UnwatchedRun(const LoadedScene& loaded)
      : sides_(make_sides(loaded.scene)),
        acts_(loaded.scene, Role::kLeader),
        tick_(from_seconds(loaded.scene.tick_s())),
        end_(from_seconds(loaded.scene.duration_s())) {}

  template <class Link>
  void to_end(Link&& link) {
    for (Nanoseconds t = 0; t <= end_; t += tick_) {
      link.deliver(t, [&](bool forward, std::span<const std::byte> bytes, Nanoseconds due) {
        Packet<1> packet;
        if (codec_.decode(bytes, packet) == DecodeResult::kOk) side(!forward).receive(packet, due);
      });
      const double t_s = to_seconds(t);
      link.send(true, codec_.encode(sides_.master->tick(t, t_s, acts_.next(t_s, both_ready(*sides_.master, t)), 1)), t);
      link.send(false, codec_.encode(sides_.slave->tick(t, t_s, OperatorAct::kNone, 1)), t);
    }
  }

 private:
  Side& side(bool master) { return *(master ? sides_.master : sides_.slave); }

  Sides sides_;
  OperatorTimeline acts_;
  Nanoseconds tick_, end_;
  PacketCodec<1> codec_;
};

// The network of a scene.
class Link {
 public:
  explicit Link(const scene::Scene& scene)
      : ways_{Way(scene, scene.network().backward(), LinkDirection::kBackward),
              Way(scene, scene.network().forward(), LinkDirection::kForward)} {}

  void send(bool forward, std::span<const std::byte> bytes, Nanoseconds t) {
    const LinkModel::Fate fate = ways_[forward].model.offer(t);
    if (!fate.lost) ways_[forward].pending.push(t + fate.delay, bytes);
  }
  template <class To>
  void deliver(Nanoseconds t, To&& to) {
    for (const bool forward : {true, false}) {
      PendingDatagrams& pending = ways_[forward].pending;
      while (!pending.empty() && pending.due() <= t) {
        const Nanoseconds due = pending.due();
        to(forward, pending.pop(), due);
      }
    }
  }

 private:
  struct Way {
    Way(const scene::Scene& scene, const scene::Path& path, LinkDirection direction)
        : model(link_params(path), scene.seed(), direction), pending(datagrams_on_way(path, scene.tick_s())) {}
    LinkModel model;
    PendingDatagrams pending;
  };
  std::array<Way, 2> ways_;
};

// Two wires.
class Wires {
 public:
  void send(bool forward, std::span<const std::byte> bytes, Nanoseconds t) {
    Wire& wire = wires_[forward];
    std::copy(bytes.begin(), bytes.end(), wire.bytes.begin());
    wire.size = bytes.size(), wire.sent = t;
  }
  template <class To>
  void deliver(Nanoseconds /*t*/, To&& to) {
    for (const bool forward : {true, false}) {
      const Wire& wire = wires_[forward];
      if (wire.size > 0) to(forward, std::span(wire.bytes).first(wire.size), wire.sent);
    }
  }

 private:
  struct Wire {
    std::array<std::byte, PendingDatagrams::kMaxBytes> bytes;
    std::size_t size = 0;
    Nanoseconds sent = 0;
  };
  std::array<Wire, 2> wires_;
};

// The whole lab with nobody watching, beside the same run that nobody can watch.
void run_without_recording(benchmark::State& state) {
  const Recorded& r = recorded();
  compare(
      state, r.session.master.size(),
      [&] {
        Witness nobody;
        simulate(r.loaded, make_sides(r.loaded.scene), nobody);
      },
      [&] { UnwatchedRun(r.loaded).to_end(Link(r.loaded.scene)); });
}
BENCHMARK(run_without_recording)->Iterations(kPairs)->UseManualTime();

// A network without delay, jitter and loss, beside two wires.
void run_without_network(benchmark::State& state) {
  const Recorded& r = recorded();
  compare(
      state, r.session.master.size(), [&] { UnwatchedRun(r.loaded).to_end(Link(r.loaded.scene)); },
      [&] { UnwatchedRun(r.loaded).to_end(Wires()); });
}
BENCHMARK(run_without_network)->Iterations(kPairs)->UseManualTime();

// What a device touches that never had a hand nor a wall to touch.
struct Nothing {
  struct Params {};
  struct Truth {};
  static constexpr std::size_t kGuards = 0;
  explicit Nothing(const Params&, double = 0) {}
  Mode mode_at(double, double, double, double = 0) const noexcept { return 0; }
  static constexpr bool acts(Mode) noexcept { return false; }
  double reaction(Mode, double, double, double) const noexcept { return 0.0; }
  double reaction_rate(Mode, double, double) const noexcept { return 0.0; }
  double stiffness(Mode, double) const noexcept { return 0.0; }
  double damping(Mode) const noexcept { return 0.0; }
  std::array<double, 0> guards(Mode, double, double) const noexcept { return {}; }
  static constexpr bool watches_speed(Mode) noexcept { return false; }
  static FreeRange free_range(const FreeRange& range) noexcept { return range; }
  template <class T, std::size_t S>
  std::array<AffineGuard<T, S>, 0> guard_forms(Mode) const noexcept {
    return {};
  }
  static constexpr Mode bit(std::size_t) noexcept { return 0; }
  double next_break(double) const noexcept { return std::numeric_limits<double>::infinity(); }
  double inertia() const noexcept { return 0.0; }
  static constexpr const char* not_affine() noexcept { return nullptr; }
  template <class T>
  T fixed_torque(Mode) const noexcept {
    return 0;
  }
  template <class T>
  Forcing<T> forcing(double t) const noexcept {
    return {.begin = T(t), .polynomial = {}, .omega = 0, .sine = 0, .cosine = 0};
  }
  double stored_energy(double, double, double) const noexcept { return 0.0; }
  PowerFlow power(Mode, double, double, double) const noexcept { return {}; }
  Truth truth(double) const noexcept { return {}; }
  Mode everything() const noexcept { return 0; }
};

// Swings a free device to and fro.
template <class P, template <class> class Solver>
class Swing {
 public:
  explicit Swing(const MotorAxis::Params& motor) : plant_(params_of(motor)), solver_(IntegratorSettings{}) {
    solver_.start(plant_, 0.0, plant_.start());
  }
  void some_seconds() {
    for (int i = 0; i < kTicks; ++i) {
      plant_.hold(0.02 * std::cos(0.01 * ++k_));
      solver_.advance(plant_, 1e-3 * k_);
      benchmark::DoNotOptimize(solver_);
    }
  }
  static constexpr int kTicks = 4000;

 private:
  static typename P::Params params_of(const MotorAxis::Params& motor) {
    typename P::Params params;
    params.motor = motor;
    return params;
  }
  alignas(64) P plant_;
  alignas(64) Solver<P> solver_;
  int k_ = 0;
};
template <class P>
using Exact = ClosedForm<P>;
template <class P>
using Stepped = Integrator<Rk4, P>;

template <template <class> class Solver>
void plant_without_hand_and_wall(benchmark::State& state) {
  const MotorAxis::Params motor = direct_slave_world_params(recorded().loaded.scene).motor;
  Swing<AxisPlant<Environment, Friction::kNone>, Solver> without(motor);
  Swing<AxisPlant<Nothing, Friction::kNone>, Solver> never(motor);
  compare(
      state, without.kTicks, [&] { without.some_seconds(); }, [&] { never.some_seconds(); });
}
BENCHMARK(plant_without_hand_and_wall<Exact>)->Iterations(kPairs)->UseManualTime();
BENCHMARK(plant_without_hand_and_wall<Stepped>)->Iterations(kPairs)->UseManualTime();

}  // namespace
}  // namespace farhand
