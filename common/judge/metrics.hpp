// The metrics of a run: a flat list of numbers with one published table of names. A value that cannot be computed is
// absent, with the reason; it is never 0.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/record/session.hpp"
#include "proto/scene.pb.h"

namespace farhand {

struct MetricInfo {
  std::string_view key;
  std::string_view unit;  // empty for text
  std::string_view meaning;
  bool deterministic = true;  // false: a figure of the wall clock, never among the results of a run in virtual time
  std::string_view formerly = {};  // the key that it had before
};

// F_m: torque of the therapist on the device; F_s: torque of the device on the hand; T_p: play-out delay in effect,
// which is the transit of the fastest packet so far (from its tick of sending to the first tick that could show it)
// plus the depth of the buffer. If the sides differ in size, the slave's torques are multiplied by force_scale and the
// master's angles by position_scale, so that the ideal values stay 1 and 0. `farhand-lab schema` prints this table.
inline constexpr auto kMetrics = std::to_array<MetricInfo>({
    {"scene", "", "name of the scene"},
    {"seed", "1", "seed of every random choice"},
    {"verdict", "", "ok, degraded or failed"},
    {"reasons", "", "why, in words; empty if ok"},
    {"force_source", "",
     "where F_m and F_s come from: true (simulated world) or estimated (reaction torque observers)"},
    {"angle_source", "", "where angles and velocities come from: true (simulated world) or estimated (encoders)"},
    {"delay_source", "",
     "what T_p rests on: link (measured one-way delays) or half_rtt (half of the fastest round trip)"},
    {"clock_offset_bound_ms", "ms", "the clocks of the two sides agree within plus or minus this"},
    {"engaged_s", "s", "time during which both sides were engaged"},
    {"held_s", "s",
     "time during which a side held after it was engaged, unless the operator asked for it or the run was over"},
    {"stable", "",
     "both sides engaged during the whole contact window without a fault, and residual_p2p_rad below 0.005 or less "
     "than half of that of the 2 s before; not judged where a sine moves the therapist or the patient at its end"},
    {"residual_p2p_rad", "rad",
     "peak to peak of the angle in the last 2 s of the contact window, the larger of the two sides; none where a sine "
     "moves the therapist or the patient then"},
    {"tracking_rms_rad", "rad", "x_s(t) - x_m(t - T_p) over the free window, RMS of engaged ticks"},
    {"tracking_peak_rad", "rad", "largest |x_s(t) - x_m(t - T_p)| in the free window"},
    {"tracking_run_rms_rad", "rad", "x_s(t) - x_m(t - T_p) over the whole run, RMS of engaged ticks"},
    {"tracking_run_peak_rad", "rad", "largest |x_s(t) - x_m(t - T_p)| of the whole run, engaged ticks"},
    {"drag_nms_per_rad", "N m s/rad",
     "sum(F_m v_m) / sum(v_m^2) over the free window: what moving freely costs the therapist"},
    {"phantom_peak_nm", "N m",
     "largest |F_m| over the whole run while the hand bore nothing: |F_s| below 0.02 N m for a second and the round "
     "trip. Without the inertia 1/K_f that is felt in every motion, and not at a stop of the master's device"},
    {"phantom_late_peak_nm", "N m", "the same after the first minute in which both sides were engaged"},
    {"force_error_rms_nm", "N m", "F_m(t) - F_s(t) at the same instant over the contact window, RMS"},
    {"force_error_peak_nm", "N m", "largest |F_m(t) - F_s(t)| in the contact window"},
    {"force_error_delayed_rms_nm", "N m",
     "f_m(t) + f_s(t - T_p), estimated torques as felt by the therapist, over the contact window, RMS"},
    {"force_error_of_motion_rms_nm", "N m",
     "F_s(t) - F_m(t - T_p) over the contact window, RMS: the torque on the hand against the one that the therapist "
     "felt when he made this motion"},
    {"force_ratio", "1", "mean F_m / mean F_s over the last 2 s of the contact window"},
    {"k_seen_ratio", "1",
     "stiffness felt by the therapist over that of the hand: (F_m/(x_m - rest)) / (F_s/(x_s - rest)), means over the "
     "last 2 s of the contact window"},
    {"energy_min_master_j", "J",
     "least value over the run of the energy taken from the therapist, integral of F_m dx_m; negative: the device gave "
     "energy to the therapist"},
    {"energy_min_slave_j", "J",
     "least value over the run of the energy taken from the hand, integral of -F_s dx_s; negative: the device did work "
     "on the hand"},
    {"energy_min_both_j", "J",
     "least value over the run of the sum of both; negative beyond what the moving parts store: the teleoperation made "
     "energy"},
    {"account_min_master_j", "J",
     "engaged, the least that was in the master's energy tank, or that its port had over (passivity observer)"},
    {"account_min_slave_j", "J", "the same at the slave"},
    {"friction_identified_nm", "N m",
     "friction of the slave's device, as the mediator identified it last from unloaded motion; 0: too little of it",
     true, "friction_named_nm"},
    {"friction_threshold_nm", "N m",
     "what the box took for the friction of its device at the end: a reaction below it may come without a hand"},
    {"friction_measured_nm", "N m", "friction F_c of the slave's device, by the last sweep without a hand"},
    {"friction_spread_nm", "N m", "how far that scattered over the angle"},
    {"friction_source", "", "what the threshold rests on: a sweep and its date, or an assumption"},
    {"f_2_identified_nm", "N m",
     "f_2 of SDCV, in the slave's size, as it was identified last from the patient (0.3 k x_max); 0: nothing to "
     "identify it by",
     true, "f_2_named_nm"},
    {"torque_max_master_nm", "N m", "largest |torque command| of the master"},
    {"torque_max_slave_nm", "N m", "largest |torque command| of the slave"},
    {"velocity_max_rad_s", "rad/s", "largest |velocity| of the two sides"},
    {"delay_forward_median_ms", "ms", "one-way delay master to slave, median of the packets that arrived"},
    {"delay_forward_p99_ms", "ms",
     "one-way delay master to slave, 99 % of the packets that arrived were at most this late"},
    {"delay_backward_median_ms", "ms", "one-way delay slave to master, median", true, "delay_return_median_ms"},
    {"delay_backward_p99_ms", "ms", "one-way delay slave to master, 99 %", true, "delay_return_p99_ms"},
    {"jitter_ms", "ms", "standard deviation of the one-way delay, the larger of the two directions"},
    {"rtt_median_ms", "ms", "round trip measured by echo at the master, median over its ticks"},
    {"playout_median_ms", "ms",
     "depth of the slave's play-out buffer over the fastest packet, median over engaged ticks"},
    {"loss", "1", "share of packets lost on the way, both directions"},
    {"late", "1", "share of the packets which arrived that came after their play-out, both directions"},
    {"reordered", "1",
     "share of the packets which arrived that had been overtaken and were still of use, both directions"},
    {"absent", "", "metrics that could not be computed, and why"},
    {"overruns", "1", "share of ticks that took longer than a period, the larger of the two sides", false},
    {"missed_ticks", "1", "share of ticks that this PC skipped, the larger of the two sides", false},
    {"longest_gap_ms", "ms", "longest time from one tick to the next, the larger of the two sides", false},
    {"real_time_factor", "1", "simulated time over wall time", false},
    {"tick_p50_us", "us", "time of one tick, median, the slower side", false},
    {"tick_p99_us", "us", "time of one tick, 99 %, the slower side", false},
    {"tick_max_us", "us", "longest tick of the two sides", false},
});

using MetricValue = std::variant<std::monostate, bool, std::uint64_t, double, std::string, std::vector<std::string>>;

struct Metric {
  const MetricInfo* info = nullptr;
  MetricValue value;
  std::string absent_because;  // not empty exactly when value is monostate
};

// Always all of kMetrics, in its order.
class Metrics {
 public:
  Metrics();
  void set(std::string_view key, MetricValue value);  // a number that is not finite becomes absent
  void set_absent(std::string_view key, std::string because);

  const std::vector<Metric>& all() const { return all_; }
  const Metric& at(std::string_view key) const;  // throws std::out_of_range on an unpublished key
  double number(std::string_view key) const;     // NaN if absent
  std::string text(std::string_view key) const;  // empty if absent
  bool is_true(std::string_view key) const;      // false if absent
  bool is_false(std::string_view key) const;     // false if absent
  const std::vector<std::string>& list(std::string_view key) const;

 private:
  Metric& find(std::string_view key);
  std::vector<Metric> all_;
};

// The scene gives the windows, the limits and the rest angle of the hand; its defaults must be filled in. Includes the
// verdict.
Metrics compute_metrics(const Session& session, const scene::Scene& scene);

}  // namespace farhand
