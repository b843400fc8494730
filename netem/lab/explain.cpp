#include "netem/lab/explain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
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
        cdob(has_cdob(s)),
        sdcv(has_sdcv(s)),
        mediated(is_mediated(s)),
        two_channel(is_two_channel(s) || has_passivity_controllers(s)),
        wave(is_wave(s)),
        tanks(has_tanks(s)),
        passivity(has_passivity_controllers(s)),
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
  bool cdob, sdcv, mediated, two_channel, wave, tanks, passivity, elastic;
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
    compensations();
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
    has(place, BlockId::kVelocity, "velocity", say("the encoder gives angles only; g_v = ", c.g_v_rad_s(), " rad/s"));
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

  void compensations() {
    const scene::Control& c = s_.control();
    if (f_.cdob) {
      Block& cdob = has(Place::kMaster, BlockId::kCdob, "CDOB", "");
      if (f_.delay_s > 0) {
        cdob.reason = say(ms(f_.delay_s), " round trip: predicts the slave; g_net = ", c.g_net_rad_s(), " rad/s");
      } else {
        cdob.reason = say("architecture = ", scene::Architecture_Name(s_.architecture()));
        cdob.needless =
            "the network delays nothing (delay_s = 0 both ways), so the CDOB compensates nothing but its own "
            "model's error; architecture FOUR_CHANNEL leaves it out";
      }
    } else {
      lacks(Place::kMaster, BlockId::kCdob, "CDOB",
            f_.mediated                 ? std::string("architecture = MODEL_MEDIATED: no loop crosses the network")
            : f_.two_channel || f_.wave ? say("architecture = ", scene::Architecture_Name(s_.architecture()),
                                              ": there is no model of the slave to observe it by")
            : f_.delay_s > 0 ? say("architecture = FOUR_CHANNEL: ", ms(f_.delay_s), " round trip stay uncompensated")
                             : std::string("no delay (delay_s = 0 both ways): there is nothing to compensate"));
    }
    if (f_.sdcv) {
      Block& sdcv = has(Place::kMaster, BlockId::kSdcv, "SDCV",
                        say("takes the compensation back in contact, between ", c.f_1_nm(), " and ", c.f_2_nm(), " N m",
                            c.sdcv_from_patient() ? ", until the patient's own are named" : ""));
      if (!f_.contact()) {
        sdcv.needless =
            "nothing to touch (no hand, no wall within reach): alpha has no reason to leave 1; architecture "
            "FOUR_CHANNEL_CDOB leaves it out";
      } else if (!f_.wall && f_.touch_nm <= c.f_1_nm()) {
        sdcv.needless =
            say("the hand presses with at most ", f_.touch_nm, " N m at ", f_.reach, " rad, below f_1 = ", c.f_1_nm(),
                " N m: alpha stays 1; architecture FOUR_CHANNEL_CDOB leaves it out");
      }
    } else if (!f_.cdob) {
      lacks(Place::kMaster, BlockId::kSdcv, "SDCV", "no CDOB whose compensation it could scale");
    } else {
      lacks(Place::kMaster, BlockId::kSdcv, "SDCV",
            f_.contact()
                ? say("architecture = FOUR_CHANNEL_CDOB: in contact the compensation stays in full")
                : std::string("nothing to touch (no hand, no wall within reach): no contact to fade it out in"));
    }
    if (f_.mediated) {
      Block& mediator = has(Place::kMaster, BlockId::kMediator, "mediator",
                            say("what the patient's side touches is felt by a model of it; ", ms(f_.delay_s),
                                " round trip only delay what the model learns"));
      if (!(f_.delay_s > 0)) {
        mediator.needless =
            "the network delays nothing (delay_s = 0 both ways): the slave itself is there; architecture FOUR_CHANNEL "
            "leaves it out";
      }
    } else {
      lacks(Place::kMaster, BlockId::kMediator, "mediator",
            say("architecture = ", scene::Architecture_Name(s_.architecture()), ": the slave is felt, not a model"));
    }
    lacks(Place::kSlave, BlockId::kMediator, "mediator", "stands on the therapist's side only");
    if (scale_of(s_).any()) {
      has(Place::kMaster, BlockId::kScale, "scale",
          say("the slave moves by ", c.position_scale(), " and is felt by ", c.force_scale()));
    } else {
      lacks(Place::kMaster, BlockId::kScale, "scale", "position_scale = force_scale = 1: both sides are of one size");
    }
    lacks(Place::kSlave, BlockId::kScale, "scale", "stands on the therapist's side only");
    for (const Place place : {Place::kMaster, Place::kSlave}) {
      const std::string architecture = say("architecture = ", scene::Architecture_Name(s_.architecture()));
      if (f_.two_channel) {
        has(place, BlockId::kTwoChannel, "two channels",
            place == Place::kMaster
                ? say("held to where the slave was: K_2 = ", c.k_2_nm_per_rad(), ", B_2 = ", c.b_2_nms_per_rad())
                : say("gives the torque that this took; damping ", c.b_slave_nms_per_rad(), " N m s/rad"));
      } else {
        lacks(place, BlockId::kTwoChannel, "two channels", architecture);
      }
      if (f_.wave) {
        has(place, BlockId::kWave, "wave",
            say("power goes each way over a line of b = ", c.wave_b_nms_per_rad(), " N m s/rad; ",
                scene::WaveMatching_Name(c.wave_matching()), " matched"));
      } else {
        lacks(place, BlockId::kWave, "wave", architecture);
      }
      if (place == Place::kMaster && chooses(s_)) {
        has(place, BlockId::kChooser, "chooser",
            "plain four channels up to a round trip of 4 ms and 2 % loss, else the mediator, as measured");
      } else {
        lacks(place, BlockId::kChooser, "chooser",
              chooses(s_) ? std::string("stands on the therapist's side only") : architecture);
      }
      if (f_.tanks) {
        has(place, BlockId::kTank, "energy tank",
            say("gives no more than it holds; ", c.tank_level_j(), " J lent, ",
                place == Place::kMaster ? "filled by a damper" : "filled by the other side"));
      } else {
        lacks(place, BlockId::kTank, "energy tank", architecture);
      }
      if (f_.passivity) {
        has(place, BlockId::kPassivity, "PO/PC", "gives no more than the other side has taken in");
      } else {
        lacks(place, BlockId::kPassivity, "PO/PC", architecture);
      }
    }
    lacks(Place::kSlave, BlockId::kCdob, "CDOB", "stands on the therapist's side only");
    lacks(Place::kSlave, BlockId::kSdcv, "SDCV", "stands on the therapist's side only");
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
