#include "common/judge/alignment.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/link/packet.hpp"

namespace farhand {
namespace {

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);

template <class Known>
bool known_anywhere(const std::vector<StationSample>& samples, Known known) {
  return std::any_of(samples.begin(), samples.end(), known);
}

// The least transit among the packets that could have been shown so far: the zero from which a receiver counts its
// play-out. A receiver looks at its ticks only, so transit runs from the send tick to the first tick after the arrival.
// Running, because nobody can know a faster packet before it came.
class FastestPacket {
 public:
  FastestPacket(const std::vector<LinkSample>& link, bool forward, const std::vector<double>& ticks_s) {
    constexpr double kSameInstant_s = 1e-7;  // rounding of seconds on the axis of a session
    Walk ticks(ticks_s);
    shown_.reserve(link.size());
    for (const LinkSample& packet : link) {
      const double arrival = packet.t_s + packet.achieved_delay_s;
      if (packet.forward != forward || packet.lost || !std::isfinite(arrival)) continue;
      any_ = true;
      const std::size_t shown = ticks.not_before(arrival - kSameInstant_s);
      if (shown < ticks_s.size()) shown_.emplace_back(ticks_s[shown], ticks_s[shown] - packet.t_s);
    }
    if (!std::is_sorted(shown_.begin(), shown_.end())) std::sort(shown_.begin(), shown_.end());
    for (std::size_t k = 1; k < shown_.size(); ++k) {
      shown_[k].second = std::min(shown_[k].second, shown_[k - 1].second);
    }
  }
  bool empty() const { return !any_; }
  // In order of time.
  double until(double t) {
    while (next_ < shown_.size() && !(t < shown_[next_].first)) ++next_;
    return next_ == 0 ? kAbsent : shown_[next_ - 1].second;
  }

 private:
  bool any_ = false;
  std::vector<std::pair<double, double>> shown_;  // tick, least transit so far
  std::size_t next_ = 0;                          // the first that is shown later
};

// Without one-way delays only their sum is known. Half of the fastest round trip is the usual guess; the caller says
// so.
double half_fastest_round_trip(const Session& session) {
  double fastest = kAbsent;
  for (const auto* side : {&session.master, &session.slave}) {
    for (const StationSample& sample : *side) {
      if (sample.rtt_s > 0) fastest = std::fmin(fastest, sample.rtt_s);
    }
  }
  return fastest / 2;
}

SideCurves curves_of(const std::vector<StationSample>& samples, double sign_F, bool true_angle, bool true_torque) {
  SideCurves side;
  for (auto* column :
       {&side.t_s, &side.x_rad, &side.v_rad_s, &side.F_nm, &side.f_nm, &side.playout_delay_s, &side.dt_s})
    column->reserve(samples.size());
  side.state.reserve(samples.size());
  for (const StationSample& s : samples) {
    if (!std::isfinite(s.t_s) || (!side.t_s.empty() && s.t_s <= side.t_s.back())) continue;
    if (!side.t_s.empty()) side.dt_s.push_back(std::min(s.t_s - side.t_s.back(), kGap_s));
    side.t_s.push_back(s.t_s);
    side.x_rad.push_back(true_angle ? s.true_x_rad : s.x_rad);
    side.v_rad_s.push_back(true_angle ? s.true_v_rad_s : s.v_rad_s);
    side.F_nm.push_back(sign_F * (true_torque ? s.true_f_nm : s.f_nm));
    side.f_nm.push_back(s.f_nm);
    side.playout_delay_s.push_back(s.playout_delay_s);  // the depth; add_transit makes it T_p
    side.state.push_back(s.state);
  }
  if (!side.t_s.empty()) side.dt_s.push_back(0);
  return side;
}

// T_p = transit of the fastest packet + depth of the buffer. Returns whether the transit was measured.
bool add_transit(SideCurves& side, const std::vector<LinkSample>& link, bool forward, double otherwise_s) {
  FastestPacket fastest(link, forward, side.t_s);
  for (std::size_t k = 0; k < side.t_s.size(); ++k) {
    side.playout_delay_s[k] += fastest.empty() ? otherwise_s : fastest.until(side.t_s[k]);
  }
  return !fastest.empty();
}

// Index of the last tick at or before t, if that tick is not a hole ago.
bool engaged_at(const SideCurves& side, Walk& walk, double t) {
  const std::size_t after = walk.after(t);
  return after > 0 && !(t - side.t_s[after - 1] > kGap_s) && side.state[after - 1] == kEngaged;
}

// By F dx and not F v dt: the angle is exact where the velocity is filtered.
std::vector<double> absorbed_energy(const SideCurves& side, double sign) {
  std::vector<double> energy(side.t_s.size(), 0.0);
  for (std::size_t k = 1; k < energy.size(); ++k) {
    const double step = sign * 0.5 * (side.F_nm[k] + side.F_nm[k - 1]) * (side.x_rad[k] - side.x_rad[k - 1]);
    energy[k] = energy[k - 1] + (std::isfinite(step) ? step : 0.0);
  }
  return energy;
}

}  // namespace

std::size_t Walk::not_before(double t) {
  constexpr int kSteps = 8;  // from there on halving is quicker
  const std::size_t count = t_s_.size();
  if (std::isnan(t)) return 0;  // as a search finds it
  for (int step = 0; step < kSteps; ++step) {
    if (at_ < count && t_s_[at_] < t) {
      ++at_;
    } else if (at_ > 0 && !(t_s_[at_ - 1] < t)) {
      --at_;
    } else {
      return at_;
    }
  }
  return at_ = static_cast<std::size_t>(std::lower_bound(t_s_.begin(), t_s_.end(), t) - t_s_.begin());
}

std::size_t Walk::after(double t) {
  if (std::isnan(t)) return t_s_.size();  // as a search finds it
  std::size_t k = not_before(t);
  while (k < t_s_.size() && !(t < t_s_[k])) ++k;
  return k;
}

double Walk::interpolate(const std::vector<double>& y, double t) {
  const std::vector<double>& t_s = t_s_;
  const std::size_t k = not_before(t);
  if (k == t_s.size()) return kAbsent;
  if (t_s[k] == t) return y[k];
  if (k == 0 || t_s[k] - t_s[k - 1] > kGap_s) return kAbsent;
  return y[k - 1] + (y[k] - y[k - 1]) * (t - t_s[k - 1]) / (t_s[k] - t_s[k - 1]);
}

AlignedSession align(const Session& session, const scene::Scene& scene) {
  AlignedSession out;
  out.position_scale = scene.control().has_position_scale() ? scene.control().position_scale() : 1.0;
  out.force_scale = scene.control().has_force_scale() ? scene.control().force_scale() : 1.0;
  const double p = out.position_scale, q = out.force_scale;
  const auto angle_known = [](const StationSample& s) {
    return std::isfinite(s.true_x_rad) && std::isfinite(s.true_v_rad_s);
  };
  const auto torque_known = [](const StationSample& s) { return std::isfinite(s.true_f_nm); };
  out.true_angle = known_anywhere(session.master, angle_known) && known_anywhere(session.slave, angle_known);
  out.true_torque = known_anywhere(session.master, torque_known) && known_anywhere(session.slave, torque_known);

  out.master = curves_of(session.master, -1, out.true_angle, out.true_torque);
  out.slave = curves_of(session.slave, +1, out.true_angle, out.true_torque);
  const double guess = half_fastest_round_trip(session);
  const bool to_slave = add_transit(out.slave, session.link, true, guess);
  const bool to_master = add_transit(out.master, session.link, false, guess);
  out.link_known = to_slave && to_master;
  const SideCurves &m = out.master, &s = out.slave;

  Walk at_master(m.t_s), at_slave(s.t_s), at_slave_then(s.t_s);
  for (auto* column : {&out.tracking_rad, &out.force_error_of_motion_nm}) column->reserve(s.t_s.size());
  for (std::size_t k = 0; k < s.t_s.size(); ++k) {
    const double sent = s.t_s[k] - s.playout_delay_s[k];
    const bool engaged = s.state[k] == kEngaged && engaged_at(m, at_master, sent);
    out.tracking_rad.push_back(engaged ? s.x_rad[k] - p * at_master.interpolate(m.x_rad, sent) : kAbsent);
    out.force_error_of_motion_nm.push_back(engaged ? q * s.F_nm[k] - at_master.interpolate(m.F_nm, sent) : kAbsent);
  }
  for (auto* column : {&out.force_error_nm, &out.force_error_delayed_nm}) column->reserve(m.t_s.size());
  for (std::size_t k = 0; k < m.t_s.size(); ++k) {
    const double now = m.t_s[k], sent = now - m.playout_delay_s[k];
    const bool engaged = m.state[k] == kEngaged;
    out.force_error_nm.push_back(
        engaged && engaged_at(s, at_slave, now) ? m.F_nm[k] - q * at_slave.interpolate(s.F_nm, now) : kAbsent);
    out.force_error_delayed_nm.push_back(engaged && engaged_at(s, at_slave_then, sent)
                                             ? m.f_nm[k] + q * at_slave_then.interpolate(s.f_nm, sent)
                                             : kAbsent);
  }
  out.energy_master_j = absorbed_energy(m, +1);
  out.energy_slave_j = absorbed_energy(s, -1);
  return out;
}

}  // namespace farhand
