#include "common/advice/warnings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <numbers>

#include "common/advice/guarded.hpp"
#include "common/advice/hammering.hpp"
#include "common/advice/scene_loops.hpp"
#include "common/analysis/bisect.hpp"
#include "common/config/effect.hpp"
#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
#include "common/config/world_params.hpp"
#include "common/plant/intended_motion.hpp"

namespace farhand {
namespace {

// Bounds are looked for in these ratios and found to 0.04 %.
constexpr double kStep = 1.5;
constexpr int kHalvings = 10;

// What takes longer than 5 s to grow by e is not seen behind friction and encoder counts.
constexpr double kGrowth = 0.2;  // 1/s

// Three digits, whatever the locale.
std::string rounded(double number) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, number, std::chars_format::general, 3).ptr;
  return {text, end};
}

std::string is(const std::string& field, double value) { return field + " = " + shortest(value); }

// A number in a scene that could be another one: to find where it would have to be.
struct Knob {
  std::string field;
  double value;
  std::function<void(scene::Scene&, double)> set;
};

// "J_n at most 0.01 or ... at most ..." of the knobs that alone make it hold, turned down from where they are.
template <class Holds>
std::string what_would_do(const scene::Scene& scene, const std::vector<Knob>& knobs, const Holds& holds) {
  constexpr double kLeast = 1e-3;  // of the present value
  std::string all;
  for (const Knob& knob : knobs) {
    if (!(knob.value > 0.0)) continue;
    scene::Scene tried = scene;
    const double most = first_failure(
        [&](double value) {
          knob.set(tried, value);
          return holds(tried);
        },
        kLeast * knob.value, knob.value, kStep, kHalvings);
    if (most <= 0.0) continue;
    all += (all.empty() ? "; it would be stable with " : ", or with ") + is(knob.field, knob.value) + " at most " +
           rounded(most);
  }
  return all;
}

class Warner {
 public:
  explicit Warner(const scene::Scene& scene) : s_(scene) {}

  std::vector<std::string> all() {
    loops();
    hammering();
    cut_offs();
    noise();
    compensation();
    reach();
    network();
    never();
    idle();
    guarded();
    return std::move(said_);
  }

 private:
  void say(const std::string& sentence) { said_.push_back(sentence); }

  // Each side by itself, then both over the network.
  void loops() {
    bool sides_rest = true;
    const auto judge = [&](const std::string& who, double radius, double period_s, const std::string& where,
                           const std::vector<Knob>& knobs, const std::function<double(const scene::Scene&)>& again) {
      if (radius >= 1.0) sides_rest = false;
      const double growth = std::log(radius) / period_s;
      if (growth < kGrowth) return;
      const double percent = 100.0 * std::expm1(1e-3 * growth);
      say("the loop of the " + who + " is unstable in " + where + ": in 1 ms it grows " +
          (std::isfinite(percent) ? "by " + rounded(percent) + " %" : "beyond all numbers") +
          what_would_do(s_, knobs, [&](const scene::Scene& tried) { return again(tried) < 1.0; }));
    };
    const auto radius_of_master = [](const scene::Scene& scene) { return spectral_radius(master_loop(scene)); };
    judge("master", radius_of_master(s_), s_.tick_s(), "the therapist's hand", side_knobs(true), radius_of_master);
    for (const Contact& contact : contacts(s_)) {
      const auto radius = [&](const scene::Scene& scene) { return slave_radius(scene, contact); };
      judge("slave", radius(s_), is_elastic(s_) ? 1.0 / s_.slave().mcu().loop_hz() : s_.tick_s(), contact.name,
            side_knobs(false), radius);
    }
    if (is_two_channel(s_)) two_channel_loop();
    if (!joined_by_four_channels(s_)) return;  // no loop of theirs goes around both
    if (!sides_rest || !(master_loop(s_).axis.k > 0.0) || !(s_.control().k_p_per_s2() > 0.0)) return;
    for (const Contact& contact : contacts(s_)) together(contact);
  }

  void two_channel_loop() {
    constexpr int kLongest = 2'000;  // ticks: beyond, the slave is long past what two channels bear
    for (const Contact& contact : contacts(s_)) {
      TwoChannels whole = two_channels(s_, contact);
      const int round_trip = whole.round_trip;
      const double factor = std::exp(kGrowth * s_.tick_s());
      if (round_trip > kLongest || growing_motions(whole, factor) == 0) continue;
      whole.round_trip = 2;
      while (whole.round_trip < round_trip && growing_motions(whole, factor) == 0) ++whole.round_trip;
      say("both sides together are unstable in " + contact.name + ": architecture TWO_CHANNEL over a round trip of " +
          rounded(round_trip * s_.tick_s()) + " s; stable up to " + rounded((whole.round_trip - 1) * s_.tick_s()) +
          " s");
    }
  }

  void together(const Contact& contact) {
    constexpr int kLongest = 12'000, kBounded = 2'000;  // ticks: beyond, counting takes too long for what it tells
    const Teleoperator whole = teleoperator(s_, contact);
    if (whole.round_trip > kLongest || growing_motions(whole, std::exp(kGrowth * s_.tick_s())) == 0) return;
    std::string sentence = "both sides together are unstable in " + contact.name + ": architecture " +
                           scene::Architecture_Name(s_.architecture()) + " over a round trip of " +
                           rounded(whole.round_trip * s_.tick_s()) + " s, master.therapist.grip " +
                           scene::Grip_Name(s_.master().therapist().grip()) + " (" + rounded(whole.master.axis.k) +
                           " N m/rad)";
    say(sentence + (whole.round_trip <= kBounded ? what_would_join(whole) : ""));
  }

  // The round trip and the grip that would do.
  std::string what_would_join(const Teleoperator& whole) const {
    const auto stable_over = [&](double ticks) {
      Teleoperator tried = whole;
      tried.round_trip = static_cast<int>(ticks);
      return growing_motions(tried) == 0;
    };
    const double held = first_failure(
        [&](double factor) {  // a firmer grip is a smaller 1/factor
          Teleoperator tried = whole;
          const SideLoop bare = whole.master;
          const double arm = master_world_params(s_).load.B_h;
          tried.master.axis.k = bare.axis.k / factor;
          tried.master.axis.b = bare.axis.b + arm * (1.0 / factor - 1.0);
          return spectral_radius(tried.master) < 1.0 && growing_motions(tried) == 0;
        },
        1e-2, 1.0, kStep, kHalvings);
    std::string sentence;
    const double ticks = std::floor(first_failure(stable_over, 1.0, whole.round_trip, kStep, kHalvings));
    if (ticks >= 1.0) sentence += "; it would be stable over at most " + rounded(ticks * s_.tick_s()) + " s";
    if (held > 0.0)
      sentence += std::string(ticks >= 1.0 ? ", or" : "; it would be stable") + " in a hand of at least " +
                  rounded(whole.master.axis.k / held) + " N m/rad";
    return sentence;
  }

  // The force gain and the inertia it is meant for come first.
  std::vector<Knob> side_knobs(bool master) const {
    const scene::Control& c = s_.control();
    const scene::Axis& axis = master ? s_.master().axis() : s_.slave().axis();
    const std::string side = master ? "master" : "slave";
    std::vector<Knob> knobs{
        {"control.K_f_per_kgm2", c.k_f_per_kgm2(),
         [](scene::Scene& s, double v) { s.mutable_control()->set_k_f_per_kgm2(v); }},
        {side + ".axis.J_n_kgm2", axis.j_n_kgm2(),
         [master](scene::Scene& s, double v) {
           (master ? s.mutable_master()->mutable_axis() : s.mutable_slave()->mutable_axis())->set_j_n_kgm2(v);
         }},
        {"control.K_d_per_s", c.k_d_per_s(), [](scene::Scene& s, double v) { s.mutable_control()->set_k_d_per_s(v); }}};
    if (!master && is_elastic(s_)) {
      const scene::McuControl& mcu = s_.slave().mcu();
      knobs.push_back({"slave.mcu.g_rad_s", mcu.g_rad_s(),
                       [](scene::Scene& s, double v) { s.mutable_slave()->mutable_mcu()->set_g_rad_s(v); }});
      knobs.push_back({"slave.mcu.spring_gain_per_s", mcu.spring_gain_per_s(),
                       [](scene::Scene& s, double v) { s.mutable_slave()->mutable_mcu()->set_spring_gain_per_s(v); }});
    } else {
      knobs.push_back({"control.g_dis_rad_s", c.g_dis_rad_s(),
                       [](scene::Scene& s, double v) { s.mutable_control()->set_g_dis_rad_s(v); }});
      knobs.push_back({"control.g_reac_rad_s", c.g_reac_rad_s(),
                       [](scene::Scene& s, double v) { s.mutable_control()->set_g_reac_rad_s(v); }});
      knobs.push_back({"tick_s", s_.tick_s(), [](scene::Scene& s, double v) { s.set_tick_s(v); }});
    }
    return knobs;
  }

  // Hard contact is hit and let go of before it stays closed.
  void hammering() {
    if (is_elastic(s_) || !(s_.control().k_p_per_s2() > 0.0)) return;
    for (const Contact& contact : contacts(s_)) {
      const double swings = std::exp(kGrowth * s_.tick_s());  // that has been said
      if (!contact.one_sided || slave_radius(s_, {}) >= swings || slave_radius(s_, contact) >= swings) continue;
      if (hits_die_out(s_, contact)) continue;
      std::vector<Knob> knobs = side_knobs(false);
      knobs.resize(2);
      say("a hit does not die out in " + contact.name + ": the slave hammers on" +
          what_would_do(s_, knobs, [&](const scene::Scene& tried) { return hits_die_out(tried, contact); }));
    }
  }

  void cut_offs() {
    const scene::Control& c = s_.control();
    const auto nyquist = [&](const std::string& field, double g, double dt, const std::string& period) {
      const double most = std::numbers::pi / dt;
      if (g > most)
        say(is(field, g) + " rad/s is above " + rounded(most) + " rad/s, half the sampling rate of " + period +
            ": it filters nothing");
    };
    const std::string tick = is("tick_s", s_.tick_s());
    nyquist("control.g_dis_rad_s", c.g_dis_rad_s(), s_.tick_s(), tick);
    nyquist("control.g_reac_rad_s", c.g_reac_rad_s(), s_.tick_s(), tick);
    nyquist("control.g_v_rad_s", c.g_v_rad_s(), s_.tick_s(), tick);
    if (has_cdob(s_)) nyquist("control.g_net_rad_s", c.g_net_rad_s(), s_.tick_s(), tick);
    if (is_elastic(s_)) {
      const scene::McuControl& mcu = s_.slave().mcu();
      const std::string loop = is("slave.mcu.loop_hz", mcu.loop_hz());
      nyquist("slave.mcu.g_rad_s", mcu.g_rad_s(), 1.0 / mcu.loop_hz(), loop);
      nyquist("slave.mcu.g_v_rad_s", mcu.g_v_rad_s(), 1.0 / mcu.loop_hz(), loop);
    }
    if (c.k_f_per_kgm2() > 0.0 && c.g_reac_rad_s() < 0.5 * c.g_dis_rad_s())
      say(is("control.g_reac_rad_s", c.g_reac_rad_s()) + " is below half of " +
          is("control.g_dis_rad_s", c.g_dis_rad_s()) +
          ": the reaction is known later than the disturbance is cancelled");
  }

  // Encoder noise that a hand can feel.
  void noise() {
    constexpr double kMost = 0.05;  // N m, at which a contact is felt
    const auto judge = [&](const std::string& whose, const std::string& encoders, double rms) {
      if (!(rms > kMost)) return;
      say(encoders + " leave " + rounded(rms) + " N m RMS in the torque of the " + whose + " through " +
          is("control.g_dis_rad_s", s_.control().g_dis_rad_s()) + ", " +
          is("control.g_reac_rad_s", s_.control().g_reac_rad_s()) + " and " +
          is("control.g_v_rad_s", s_.control().g_v_rad_s()) + ", more than " + rounded(kMost) + "; " +
          rounded(rms / kMost) + " times as many counts would do");
    };
    const SideLoop master = master_loop(s_);
    const double counts = s_.master().motor().encoder_counts_per_rev();
    const std::string encoder = is("master.motor.encoder_counts_per_rev", counts);
    if (spectral_radius(master) >= 1.0) return;
    if (is_elastic(s_)) return judge("master", encoder, encoder_noise(master, counts));
    const SideLoop slave = direct_slave_loop(s_, {});
    if (spectral_radius(slave) >= 1.0) return;
    const double slave_counts = s_.slave().motor().encoder_counts_per_rev();
    const std::string encoders = encoder + " and " + is("slave.motor.encoder_counts_per_rev", slave_counts);
    const double size = scale_of(s_).position;  // of a count, on the other side
    judge("master", encoders,
          std::hypot(encoder_noise(master, counts), encoder_noise(master, slave, size * slave_counts)));
    judge("slave", encoders,
          std::hypot(encoder_noise(slave, slave_counts), encoder_noise(slave, master, counts / size)));
  }

  // What the compensation takes from the force is given back only above f_2.
  void compensation() {
    if (!has_sdcv(s_) || s_.control().local_model() == scene::WITH_FORCE) return;
    const double f_1 = s_.control().f_1_nm(), f_2 = s_.control().f_2_nm(), force = scale_of(s_).force;
    for (const Contact& contact : contacts(s_)) {
      const auto steady = steady_contact(s_, contact);
      if (!steady || steady->reach == 0.0 || names_thresholds(s_, contact)) continue;
      const double alpha = resting_alpha(*steady, force * f_1, force * f_2);
      if (alpha < 0.01) continue;
      const double most = largest_f_2(*steady, force * f_1) / force;
      say(is("control.f_2_nm", f_2) + " N m is not reached in " + contact.name + ": alpha stays at " + rounded(alpha) +
          (most > f_1 ? "; f_2 at most " + rounded(most) + " N m would be"
                      : "; with " + is("control.f_1_nm", f_1) + " N m no f_2 would be"));
    }
  }

  // Intended motion against ranges, stops, speeds and torques.
  void reach() {
    const auto intended = master_world_params(s_).load.intended;
    const IntendedMotion motion(intended, 0.0);
    double low = 0, high = 0, fastest = 0;
    for (double t = 0; t <= std::min(motion.end(), s_.duration_s()); t += 0.005) {
      const auto at = motion.at(t);
      low = std::min(low, at.x), high = std::max(high, at.x), fastest = std::max(fastest, std::abs(at.v));
    }
    const auto within = [&](const std::string& prefix, const char* min_name, double min, const char* max_name,
                            double max) {
      constexpr double kSlack = 1e-6;
      const double size = prefix.starts_with("slave") ? scale_of(s_).position : 1.0;
      const std::string there = size == 1.0 ? "" : " at the slave";
      if (size * high > max + kSlack)
        say("master.therapist.intended goes to " + rounded(size * high) + " rad" + there + ", beyond " +
            is(prefix + max_name, max));
      if (size * low < min - kSlack)
        say("master.therapist.intended goes to " + rounded(size * low) + " rad" + there + ", beyond " +
            is(prefix + min_name, min));
    };
    const auto range = [&](const std::string& side, const scene::Axis& axis) {
      within(side + ".axis.", "range_min_rad", axis.range_min_rad(), "range_max_rad", axis.range_max_rad());
    };
    range("master", s_.master().axis());
    range("slave", s_.slave().axis());
    const auto stops = [&](const std::string& prefix, double min, double max) {
      within(prefix, "stop_min_rad", min, "stop_max_rad", max);
    };
    stops("master.motor.", s_.master().motor().stop_min_rad(), s_.master().motor().stop_max_rad());
    if (is_elastic(s_)) {
      const scene::SeriesElastic& e = s_.slave().series_elastic();
      stops("slave.series_elastic.", e.stop_min_rad(), e.stop_max_rad());
      // Each command moves the MCU's references by a millisecond's worth at most.
      const double moved = s_.slave().axis().velocity_limit_rad_s() * 0.001 / s_.tick_s();
      if (fastest > moved && s_.tick_s() > 0.001)
        say("master.therapist.intended moves at " + rounded(fastest) + " rad/s, faster than " + rounded(moved) +
            " rad/s, to which " + is("tick_s", s_.tick_s()) +
            " slows the MCU: it moves by 1 ms of slave.axis.velocity_limit_rad_s with each command");
      for (const auto& [field, limit] :
           {std::pair<std::string, double>{"slave.axis.velocity_limit_rad_s", s_.slave().axis().velocity_limit_rad_s()},
            {"slave.series_elastic.motor_speed_limit_rad_s", e.motor_speed_limit_rad_s()}})
        if (fastest > limit)
          say("master.therapist.intended moves at " + rounded(fastest) + " rad/s, faster than " + is(field, limit));
    } else {
      stops("slave.motor.", s_.slave().motor().stop_min_rad(), s_.slave().motor().stop_max_rad());
    }
    for (const Contact& contact : contacts(s_)) torque_in(contact);
  }

  void torque_in(const Contact& contact) {
    const auto steady = steady_contact(s_, contact);
    if (!steady) return;
    const double alpha = alpha_in(s_, contact);
    const auto judge = [&](const std::string& field, double limit, double needed) {
      if (needed > limit)
        say(is(field, limit) + " N m is less than the " + rounded(needed) + " N m that the intended motion takes in " +
            contact.name);
    };
    judge("slave.axis.torque_limit_nm", s_.slave().axis().torque_limit_nm(), steady->slave_torque(alpha));
    judge("master.axis.torque_limit_nm", s_.master().axis().torque_limit_nm(), steady->master_torque(alpha));
  }

  void network() {
    const scene::Receive& r = s_.receive();
    const scene::Network& n = s_.network();
    for (const auto& [name, path] : {std::pair<std::string, const scene::Path&>{"network.forward.", n.forward()},
                                     {"network.backward.", n.backward()}}) {
      const double needed = needed_playout_s(path);
      const std::string jitter = is(name + "jitter_s", path.jitter_s());
      if (r.playout_max_s() < needed)
        say(is("receive.playout_max_s", r.playout_max_s()) + " s is less than the " + rounded(needed) +
            " s over which " + jitter + " spreads the packets: what comes later is not played");
      if (r.expiry_s() < needed)
        say(is("receive.expiry_s", r.expiry_s()) + " s is less than the " + rounded(needed) + " s over which " +
            jitter + " spreads the packets: what is older is thrown away");
      gaps(name, path);
    }
    const double round_trip = n.forward().delay_s() + n.backward().delay_s() +
                              0.5 * (needed_playout_s(n.forward()) + needed_playout_s(n.backward()));
    if (s_.engagement().timeout_s() < round_trip)
      say(is("engagement.timeout_s", s_.engagement().timeout_s()) + " s is less than the round trip of " +
          rounded(round_trip) + " s (network delays and play-out): the master gives up before the slave can answer");
  }

  // Silence by chance: so many packets in a row lost that a station holds.
  void gaps(const std::string& name, const scene::Path& path) {
    const double ticks = s_.duration_s() / s_.tick_s();
    const double in_a_row = std::ceil(s_.receive().timeout_s() / s_.tick_s());
    const double most = std::pow(1.0 / ticks, 1.0 / in_a_row);
    if (path.loss() > most)
      say(is(name + "loss", path.loss()) + " is above " + rounded(most) + ", from which a silence of " +
          is("receive.timeout_s", s_.receive().timeout_s()) + " s is to be expected within the run: the station holds");
  }

  // Kept for another device or architecture, or of something that is absent.
  void idle() {
    for (const Complaint& setting : idle_settings(s_)) say(setting.sentence);
  }

  void guarded() {
    for (const Complaint& setting : unguarded_settings(s_)) say(setting.sentence);
  }

  void never() {
    for (int i = 0; i < s_.operator_acts_size(); ++i)
      if (s_.operator_acts(i).at_s() > s_.duration_s())
        say(is("operator_acts[" + std::to_string(i) + "].at_s", s_.operator_acts(i).at_s()) +
            " lies after the end of the run, " + is("duration_s", s_.duration_s()));
    if (s_.master().motor().gravity_nm() > s_.master().axis().torque_limit_nm())
      say(is("master.axis.torque_limit_nm", s_.master().axis().torque_limit_nm()) + " N m cannot hold the weight of " +
          is("master.motor.gravity_nm", s_.master().motor().gravity_nm()));
  }

  const scene::Scene& s_;
  std::vector<std::string> said_;
};

}  // namespace

std::vector<std::string> warnings(const scene::Scene& scene) { return Warner(scene).all(); }

}  // namespace farhand
