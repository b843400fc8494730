#include "netem/lab/endure.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "netem/lab/audited_sides.hpp"

namespace farhand {
namespace {

using Clock = std::chrono::steady_clock;

// Second number of statm, in pages. Read without a stream, which would touch the heap.
std::uint64_t resident_bytes() noexcept {
  char text[64] = {};
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const ssize_t size = ::read(file, text, sizeof text - 1);
  ::close(file);
  char* end = text;
  if (size > 0) std::strtoull(text, &end, 10);
  return std::strtoull(end, nullptr, 10) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

class Hours final : public Witness {
 public:
  Hours(const Sides& sides, const Balances& balances, double tick_s, double stretch_s,
        const std::function<void(const Stretch&)>& tell, const Workload& work)
      : sides_(sides),
        balances_(balances),
        tell_(tell),
        work_(work),
        tick_s_(tick_s),
        stretch_s_(stretch_s),
        until_s_(stretch_s) {}

  // Both sides tick at each instant, the master first; the slave closes it.
  void ticked(bool master, const Side& side, double t_s, OperatorAct) override {
    if (master) {
      if (t_s >= until_s_ - 0.5 * tick_s_ && ticks_ > 0) close(t_s);
      F_m_ = -side.truth().f;
      master_engaged_ = side.trace().state == StationState::kEngaged;
      return;
    }
    for (; t_s >= next_second_s_; next_second_s_ += 1.0) {
      work_.done_one();
      work_.require_all(!work_.stopped());
    }
    ++ticks_;
    depth_ += to_seconds(side.trace().playout_depth);
    if (!master_engaged_ || side.trace().state != StationState::kEngaged) return;
    ++engaged_;
    const Truth truth = side.truth();
    tracking_.add(truth.x - side.trace().remote.x[0]);
    force_.add(F_m_ - truth.f);
  }

  void close(double t_s) {
    const Balances now = balances_;
    const ReceiverCounters m = sides_.master->receiver().counters(), s = sides_.slave->receiver().counters();
    Stretch stretch;
    stretch.until_s = t_s;
    stretch.engaged_s = static_cast<double>(engaged_) * tick_s_;
    stretch.tracking_rms_rad = tracking_.rms();
    stretch.tracking_peak_rad = tracking_.peak;
    stretch.force_error_rms_nm = force_.rms();
    stretch.force_error_peak_nm = force_.peak;
    stretch.energy_residual_master_j = now.master.residual_j - before_.master.residual_j;
    stretch.energy_residual_slave_j = now.slave.residual_j - before_.slave.residual_j;
    stretch.energy_rounding_master_j = now.master.rounding_j - before_.master.rounding_j;
    stretch.energy_rounding_slave_j = now.slave.rounding_j - before_.slave.rounding_j;
    stretch.energy_exchanged_j =
        now.master.exchanged_j - before_.master.exchanged_j + now.slave.exchanged_j - before_.slave.exchanged_j;
    stretch.playout_mean_s = depth_ / static_cast<double>(ticks_);
    stretch.lost = m.lost + s.lost - lost_;
    stretch.late = m.late + s.late - late_;
    stretch.not_finite = m.rejected_not_finite + s.rejected_not_finite;
    const Clock::time_point wall = Clock::now();
    stretch.wall_s = std::chrono::duration<double>(wall - wall_).count();
    stretch.resident_bytes = resident_bytes();
    tell_(stretch);
    before_ = now;
    lost_ = m.lost + s.lost;
    late_ = m.late + s.late;
    wall_ = wall;
    tracking_ = force_ = {};
    depth_ = 0;
    ticks_ = engaged_ = 0;
    until_s_ += stretch_s_;
  }
  bool anything_left() const { return ticks_ > 1; }

 private:
  struct Error {
    double squares = 0, peak = 0;
    std::uint64_t count = 0;
    void add(double error) noexcept {
      squares += error * error;
      peak = std::fmax(peak, std::fabs(error));
      ++count;
    }
    double rms() const noexcept { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0; }
  };

  const Sides& sides_;
  const Balances& balances_;
  const std::function<void(const Stretch&)>& tell_;
  const Workload& work_;
  double tick_s_, stretch_s_, until_s_, next_second_s_ = 1.0;
  Balances before_;
  Error tracking_, force_;
  double F_m_ = 0, depth_ = 0;
  bool master_engaged_ = false;
  std::uint64_t ticks_ = 0, engaged_ = 0, lost_ = 0, late_ = 0;
  Clock::time_point wall_ = Clock::now();
};

}  // namespace

LoadedScene repeated(LoadedScene loaded, double duration_s) {
  scene::Therapist& therapist = *loaded.scene.mutable_master()->mutable_therapist();
  const google::protobuf::RepeatedPtrField<scene::Movement> session = therapist.intended();
  double length_s = 0;
  for (const scene::Movement& movement : session) length_s += movement.duration_s();
  for (double end_s = length_s; length_s > 0 && end_s < duration_s; end_s += length_s)
    therapist.mutable_intended()->MergeFrom(session);
  loaded.scene.set_duration_s(duration_s);
  scene::Limits& limits = *loaded.scene.mutable_slave()->mutable_limits();
  limits.set_session_s(std::max(limits.session_s(), duration_s));  // it bounds one of these sessions
  return loaded;
}

void endure(const LoadedScene& loaded, double stretch_s, const std::function<void(const Stretch&)>& tell,
            const Workload& work) {
  Balances balances;
  const Sides sides = make_audited_sides(loaded.scene, balances);
  Hours hours(sides, balances, loaded.scene.tick_s(), stretch_s, tell, work);
  work.each_of(static_cast<std::size_t>(loaded.scene.duration_s()), 1,
               [&](std::size_t) { simulate(loaded, sides, hours); });
  if (hours.anything_left()) hours.close(loaded.scene.duration_s());
}

}  // namespace farhand
