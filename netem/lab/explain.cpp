#include "netem/lab/explain.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
#include "common/law/architectures.hpp"
#include "netem/lab/explain_costs.hpp"
#include "netem/lab/explain_plants.hpp"
#include "netem/lab/explain_sizes.hpp"

namespace farhand {
namespace {

template <class... Parts>
std::string say(const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return text.str();
}

std::string ms(double seconds) { return say(1e3 * seconds, " ms"); }

// What the reasons speak of.
struct Facts {
  explicit Facts(const scene::Scene& s)
      : delay_s(s.network().forward().delay_s() + s.network().backward().delay_s()),
        jitter_s(std::max(jitter(s.network().forward()), jitter(s.network().backward()))),
        loss(std::max(s.network().forward().loss(), s.network().backward().loss())),
        elastic(s.slave().device() == scene::SERIES_ELASTIC) {
    double at = 0;
    for (const scene::Movement& m : s.master().therapist().intended()) {
      reach = std::max(reach, std::fabs(at) + m.sine_amplitude_rad());
      if (m.has_ramp_to_rad()) at = m.ramp_to_rad();
      reach = std::max(reach, std::fabs(at));
    }
    const scene::Hand& h = s.slave().hand();
    hand_given = s.slave().has_hand();
    hand = hand_given && h.from_s() < s.duration_s() &&
           (h.stiffness_nm_per_rad() > 0 || h.damping_nms_per_rad() > 0 || h.spastic_nms_per_rad() > 0 ||
            h.tremor_nm() > 0);
    if (hand) {
      const double stretch = scale_of(s).position * reach + std::fabs(h.rest_rad()) + h.rest_amplitude_rad();
      touch_nm = h.stiffness_nm_per_rad() * stretch + h.tremor_nm();
      if (h.spastic_nms_per_rad() > 0) touch_nm = std::numeric_limits<double>::infinity();  // follows the speed
    }
    const double min = elastic ? s.slave().series_elastic().stop_min_rad() : s.slave().motor().stop_min_rad();
    const double max = elastic ? s.slave().series_elastic().stop_max_rad() : s.slave().motor().stop_max_rad();
    wall_given = s.slave().has_wall();
    stop = s.slave().wall().at_rad() < 0 ? min : max;
    // The other way round the device would have to go through its stop.
    wall = wall_given &&
           (s.slave().wall().at_rad() < 0 ? s.slave().wall().at_rad() > min : s.slave().wall().at_rad() < max);
  }
  static double jitter(const scene::Path& path) {
    return path.distribution() == scene::CONSTANT ? 0.0 : path.jitter_s();
  }
  bool contact() const { return hand || wall; }

  double delay_s, jitter_s, loss;
  bool elastic;
  bool hand_given = false, hand = false, wall_given = false, wall = false;
  double reach = 0;     // largest |angle| that the therapist intends, rad
  double touch_nm = 0;  // most that the hand can press back with there
  double stop = 0;      // on the side of the wall
};

class Builder {
 public:
  Builder(const LoadedScene& loaded, Explanation& to) : s_(loaded.scene), f_(loaded.scene), to_(to) {}

  void build() {
    station(Place::kMaster, s_.master().axis(), false);
    laws();
    sizes_of_sides();
    station(Place::kSlave, s_.slave().axis(), f_.elastic);
    link();
    device();
    world();
    run();
  }

 private:
  Block& has(Place place, BlockId id, const char* name, std::string reason) {
    to_.blocks.push_back({place, id, name, true, std::move(reason)});
    return to_.blocks.back();
  }
  void lacks(Place place, BlockId id, const char* name, std::string reason) {
    to_.blocks.push_back({place, id, name, false, std::move(reason)});
  }

  void station(Place place, const scene::Axis& axis, bool elastic) {
    const scene::Control& c = s_.control();
    std::string velocity = say("the encoder gives angles only; g_v = ", c.g_v_rad_s(), " rad/s");
    if (const double counts = coarsest_counts(s_); default_g_v(s_) != 500.0 && c.g_v_rad_s() == default_g_v(s_))
      velocity += say(", because an encoder has only ", shortest(counts), " counts; guards keep 500 rad/s");
    has(place, BlockId::kVelocity, "velocity", std::move(velocity));
    if (elastic) {
      const char* why = "slave.device = SERIES_ELASTIC: the MCU closes this loop itself, the PC sends references";
      lacks(place, BlockId::kDob, "DOB", why);
      lacks(place, BlockId::kRtob, "RTOB", why);
      lacks(place, BlockId::kLaw, "four channels", why);
      lacks(place, BlockId::kTorqueGate, "torque gate", "no torque leaves this PC, only references");
      has(place, BlockId::kReferenceGate, "reference gate",
          say("references are kept within ", axis.range_min_rad(), " to ", axis.range_max_rad(), " rad and ",
              axis.velocity_limit_rad_s(), " rad/s"));
    } else {
      has(place, BlockId::kDob, "DOB",
          say("what the model of J_n = ", axis.j_n_kgm2(), " kg m2 does not explain; g_dis = ", c.g_dis_rad_s(),
              " rad/s"));
      has(place, BlockId::kRtob, "RTOB",
          say("the law needs the torque of the person and nothing measures it; g_reac = ", c.g_reac_rad_s(), " rad/s"));
      if (axis.gravity_nm() > 0) {
        has(place, BlockId::kWeight, "weight compensation", say("axis.gravity_nm = ", axis.gravity_nm()));
      } else {
        lacks(place, BlockId::kWeight, "weight compensation", "axis.gravity_nm = 0: no weight is known");
      }
      if (axis.coulomb_nm() > 0) {
        has(place, BlockId::kCoulomb, "Coulomb model", say("axis.coulomb_nm = ", axis.coulomb_nm()));
      } else {
        lacks(place, BlockId::kCoulomb, "Coulomb model", "axis.coulomb_nm = 0: no dry friction is known");
      }
      has(place, BlockId::kLaw, "four channels",
          say("K_p = ", c.k_p_per_s2(), ", K_d = ", c.k_d_per_s(), ", K_f = ", c.k_f_per_kgm2(),
              ": positions together, forces to zero sum"));
      has(place, BlockId::kTorqueGate, "torque gate",
          say("nothing beyond ", axis.torque_limit_nm(), " N m, ", axis.torque_rate_limit_nm_per_s(),
              " N m/s and the range leaves"));
      lacks(place, BlockId::kReferenceGate, "reference gate", "this axis takes torques, not references");
    }
    has(place, BlockId::kBlend, "blend", "nothing jumps when the side engages, holds or lets go");
    has(place, BlockId::kEngagement, "engagement", "nothing moves before the operator engages");
    if (place == Place::kSlave) {
      const scene::Limits& l = s_.slave().limits();
      has(place, BlockId::kGuard, "guard",
          say("gives the hand at most ", l.power_w(), " W and ", l.energy_j_per_min(),
              " J/min, refuses readings that cannot be, holds what shakes with more than ",
              s_.slave().shaking_limit_rad_s(), " rad/s"));
    } else {
      lacks(place, BlockId::kGuard, "guard", "stands on the patient's side only");
    }
    has(place, BlockId::kReceiver, "receiver and play-out",
        "the peer's packets, put in order and shown at one steady delay");
  }

  // What the laws of both sides consist of, and what those of other architectures would.
  void laws() {
    const Architecture& own = architecture(scene::Architecture_Name(s_.architecture()));
    std::vector<const LawBlock*> all;
    for (const Architecture& row : architectures()) {
      for (const LawMaker& side : {row.master, row.slave}) {
        for (const LawBlock& block : side.blocks) {
          if (std::ranges::none_of(all, [&](const LawBlock* known) { return known->name == block.name; }))
            all.push_back(&block);
        }
      }
    }
    for (const auto& [place, law] : {std::pair{Place::kMaster, &own.master}, {Place::kSlave, &own.slave}}) {
      for (const LawBlock* known : all) {
        const std::string name(known->name);
        const LawBlock* block = block_of(*law, known->name);
        if (block != nullptr && !block->asked_by.empty() && value_text(s_, block->asked_by) != "true") {
          lacks(place, BlockId::kLawBlock, name.c_str(), say(block->asked_by, " = false"));
        } else if (block != nullptr) {
          Block& there = has(place, BlockId::kLawBlock, name.c_str(), reason_of(*block));
          there.needless = needless(*block);
          there.bytes = block->bytes;
        } else {
          lacks(place, BlockId::kLawBlock, name.c_str(), why_not(place, *known));
        }
      }
    }
  }

  std::string reason_of(const LawBlock& block) const {
    std::string reason(block.why);
    if (block.idle == Idle::kWithoutDelay && f_.delay_s > 0) reason += ": " + ms(f_.delay_s) + " round trip";
    for (const std::string_view setting : block.settings) {
      if (!setting.empty()) reason += say("; ", setting.substr(setting.rfind('.') + 1), " = ", value_text(s_, setting));
    }
    return reason;
  }

  std::string needless(const LawBlock& block) const {
    const std::string out = say("; architecture ", block.instead, " leaves it out");
    if (block.idle == Idle::kWithoutDelay && !(f_.delay_s > 0))
      return "the network delays nothing (delay_s = 0 both ways)" + out;
    if (block.idle != Idle::kWithoutContact) return "";
    if (!f_.contact()) return "nothing to touch (no hand, no wall within reach)" + out;
    if (block.touch.empty() || f_.wall) return "";
    const std::string touch = value_text(s_, block.touch);
    double touch_nm = 0.0;
    std::from_chars(touch.data(), touch.data() + touch.size(), touch_nm);
    if (f_.touch_nm > touch_nm) return "";
    return say("the hand presses with at most ", f_.touch_nm, " N m at ", f_.reach, " rad, not above ", block.touch,
               " = ", touch, " N m", out);
  }

  std::string why_not(Place place, const LawBlock& block) const {
    const auto side = [&](const Architecture& row, bool here) -> const LawMaker& {
      return (place == Place::kMaster) == here ? row.master : row.slave;
    };
    const auto has_it = [&](bool here) {
      return std::ranges::any_of(
          architectures(), [&](const Architecture& row) { return block_of(side(row, here), block.name) != nullptr; });
    };
    if (!has_it(true))
      return place == Place::kSlave ? "stands on the therapist's side only" : "stands on the patient's side only";
    if (block.idle == Idle::kWithoutDelay && !(f_.delay_s > 0))
      return "no delay (delay_s = 0 both ways): there is nothing for it to do";
    if (block.idle == Idle::kWithoutContact && !f_.contact())
      return "nothing to touch (no hand, no wall within reach): there is nothing for it to do";
    return say("architecture = ", scene::Architecture_Name(s_.architecture()), ": ", block.without);
  }

  void sizes_of_sides() {
    const scene::Control& c = s_.control();
    if (scale_of(s_).any()) {
      has(Place::kMaster, BlockId::kScale, "scale",
          say("the slave moves by ", c.position_scale(), " and is felt by ", c.force_scale()));
    } else {
      lacks(Place::kMaster, BlockId::kScale, "scale", "position_scale = force_scale = 1: both sides are of one size");
    }
    lacks(Place::kSlave, BlockId::kScale, "scale", "stands on the therapist's side only");
  }

  void link() {
    const scene::Path &there = s_.network().forward(), &back = s_.network().backward();
    has(Place::kLink, BlockId::kCodec, "codec",
        "what the lab sends are the bytes that the programs send, checksum included");
    if (f_.delay_s > 0) {
      has(Place::kLink, BlockId::kDelay, "delay", say(ms(there.delay_s()), " there, ", ms(back.delay_s()), " back"));
    } else {
      lacks(Place::kLink, BlockId::kDelay, "delay", "delay_s = 0 both ways: a packet is there at the next tick");
    }
    if (f_.jitter_s > 0) {
      has(Place::kLink, BlockId::kJitter, "jitter",
          say("jitter_s = ", there.jitter_s(), " there, ", back.jitter_s(), " back"));
      has(Place::kLink, BlockId::kPlayoutDepth, "play-out depth",
          say("packets wait for the slow ones: spread of ", ms(2 * f_.jitter_s)));
    } else {
      const bool ignored = there.jitter_s() > 0 || back.jitter_s() > 0;
      lacks(Place::kLink, BlockId::kJitter, "jitter",
            ignored ? "distribution CONSTANT: the jitter_s that is given has no effect" : "jitter_s = 0 both ways");
      lacks(Place::kLink, BlockId::kPlayoutDepth, "play-out depth",
            "no jitter: every packet is as fast as the fastest, depth 0");
    }
    if (f_.loss > 0) {
      has(Place::kLink, BlockId::kLoss, "loss", say(100 * there.loss(), " % there, ", 100 * back.loss(), " % back"));
    } else {
      lacks(Place::kLink, BlockId::kLoss, "loss", "loss = 0 both ways");
    }
    const double offset = s_.network().peer_clock_offset_s(), skew = s_.network().peer_clock_skew_ppm();
    if (offset != 0 || skew != 0) {
      has(Place::kLink, BlockId::kClock, "foreign clock",
          say("the slave's clock is ", offset, " s ahead and gains ", skew, " ppm"));
    } else {
      lacks(Place::kLink, BlockId::kClock, "foreign clock", "offset and skew of the slave's clock are 0");
    }
  }

  void device() {
    const scene::SeriesElastic& e = s_.slave().series_elastic();
    if (!f_.elastic) {
      const char* why = "slave.device = DIRECT_DRIVE: the motor takes the PC's torque";
      lacks(Place::kSlave, BlockId::kSerial, "serial line", why);
      lacks(Place::kSlave, BlockId::kMcu, "MCU", why);
      return;
    }
    has(Place::kSlave, BlockId::kSerial, "serial line",
        say("slave.device = SERIES_ELASTIC: frames of 10 bytes, ", ms(e.serial_one_way_s()), " each way"));
    has(Place::kSlave, BlockId::kMcu, "MCU",
        say("slave.device = SERIES_ELASTIC: the slave's law in scaled integers at ", s_.slave().mcu().loop_hz(),
            " Hz"));
  }

  void world() {
    const scene::Motor &m = s_.master().motor(), &n = s_.slave().motor();
    has(Place::kWorldMaster, BlockId::kPlant, "motor and therapist",
        say("J + J_h = ", m.j_kgm2() + s_.master().therapist().j_h_kgm2(), " kg m2",
            s_.master().therapist().has_reaction() ? ", gives way" : ""));
    weight(Place::kWorldMaster, m.gravity_nm());
    friction(Place::kWorldMaster, m);
    if (f_.elastic) {
      const scene::SeriesElastic& e = s_.slave().series_elastic();
      has(Place::kWorldSlave, BlockId::kPlant, "orthosis", say("joint of ", e.j_joint_kgm2(), " kg m2"));
      has(Place::kWorldSlave, BlockId::kSpring, "series spring",
          say("slave.device = SERIES_ELASTIC: ", e.spring_nm_per_rad(), " N m/rad between motor and joint"));
      if (e.has_tendon_lugre()) {
        has(Place::kWorldSlave, BlockId::kFriction, "bristle of the tendons",
            say("tendon_lugre of ", e.tendon_lugre().sigma_0_nm_per_rad(), " N m/rad"));
      } else if (e.tendon_friction_nm() > 0) {
        has(Place::kWorldSlave, BlockId::kFriction, "bristle of the tendons",
            say("tendon_friction_nm = ", e.tendon_friction_nm()));
      } else {
        lacks(Place::kWorldSlave, BlockId::kFriction, "bristle of the tendons",
              "tendon_friction_nm = 0: no friction, no bristle state");
      }
    } else {
      has(Place::kWorldSlave, BlockId::kPlant, "motor", say("J = ", n.j_kgm2(), " kg m2"));
      lacks(Place::kWorldSlave, BlockId::kSpring, "series spring", "slave.device = DIRECT_DRIVE: rigid");
      friction(Place::kWorldSlave, n);
      weight(Place::kWorldSlave, n.gravity_nm());
    }
    environment();
  }

  void friction(Place place, const scene::Motor& motor) {
    if (motor.has_lugre()) {
      has(place, BlockId::kFriction, "friction",
          say("motor.lugre: a bristle of ", motor.lugre().sigma_0_nm_per_rad(), " N m/rad"));
    } else if (motor.coulomb_nm() > 0) {
      has(place, BlockId::kFriction, "friction",
          say("motor.coulomb_nm = ", motor.coulomb_nm(), ": sticks and slides, no bristle state"));
    } else {
      lacks(place, BlockId::kFriction, "friction",
            "motor.coulomb_nm = 0, no lugre: neither sticking nor bristle state");
    }
  }

  void weight(Place place, double gravity_nm) {
    if (gravity_nm > 0) {
      has(place, BlockId::kPlantWeight, "weight", say("motor.gravity_nm = ", gravity_nm));
    } else {
      lacks(place, BlockId::kPlantWeight, "weight", "motor.gravity_nm = 0");
    }
  }

  void environment() {
    const scene::Hand& h = s_.slave().hand();
    if (!f_.hand_given) {
      lacks(Place::kWorldSlave, BlockId::kHand, "hand", "slave.hand is absent: nothing is in the orthosis");
    } else {
      Block& hand = has(Place::kWorldSlave, BlockId::kHand, "hand",
                        say(h.stiffness_nm_per_rad(), " N m/rad from ", h.from_s(), " s",
                            h.spastic_nms_per_rad() > 0 ? ", spastic" : "", h.rest_amplitude_rad() > 0 ? ", moves" : "",
                            h.has_relaxed_nm_per_rad() ? ", relaxes" : "", h.tremor_nm() > 0 ? ", trembles" : ""));
      if (h.from_s() >= s_.duration_s()) {
        hand.needless = say("the hand is put in after the run of ", s_.duration_s(), " s; leave slave.hand out");
      } else if (!f_.hand) {
        hand.needless = "stiffness and damping are 0: the hand exerts nothing; leave slave.hand out";
      }
    }
    const scene::Wall& w = s_.slave().wall();
    if (!f_.wall_given) {
      lacks(Place::kWorldSlave, BlockId::kWall, "wall", "slave.wall is absent");
    } else {
      Block& wall = has(Place::kWorldSlave, BlockId::kWall, "wall",
                        say(w.stiffness_nm_per_rad(), " N m/rad at ", w.at_rad(), " rad"));
      if (!f_.wall)
        wall.needless =
            say("the wall lies behind the stop at ", f_.stop, " rad and is out of reach; leave slave.wall out");
    }
  }

  void run() {
    lacks(Place::kRun, BlockId::kRecording, "recording",
          "not asked for: farhand-lab run keeps a recording with --record only");
  }

  const scene::Scene& s_;
  Facts f_;
  Explanation& to_;
};

}  // namespace

const char* name_of(Place place) {
  constexpr const char* kNames[] = {"master", "slave", "link", "world of the master", "world of the slave", "run"};
  return kNames[static_cast<int>(place)];
}

Explanation explain_without_costs(const LoadedScene& loaded) {
  Explanation explanation;
  explanation.scene = loaded.name;
  Builder(loaded, explanation).build();
  explain_plants(loaded.scene, explanation);
  add_sizes(loaded.scene, explanation);
  return explanation;
}

Explanation explain(const LoadedScene& loaded) {
  Explanation explanation = explain_without_costs(loaded);
  add_costs(loaded, explanation);
  return explanation;
}

}  // namespace farhand
