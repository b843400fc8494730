#include "netem/lab/explain_blocks.hpp"

#include "common/law/acceleration_law.hpp"
#include "common/law/cdob.hpp"
#include "common/law/chooser.hpp"
#include "common/law/energy_tank.hpp"
#include "common/law/mediator.hpp"
#include "common/law/passivity.hpp"
#include "common/law/sdcv.hpp"
#include "common/law/two_channel.hpp"
#include "common/law/wave_variables.hpp"
#include "common/observer/rtob.hpp"
#include "common/signal/derivative.hpp"
#include "common/station/blend.hpp"
#include "common/station/limits.hpp"
#include "common/station/patient_guard.hpp"
#include "netem/lab/measure.hpp"

namespace farhand {
namespace {

Motion<1> motion(double x, double v, double f) { return {Joints<1>(x), Joints<1>(v), Joints<1>(f)}; }
Motion<1> local(const BlockInputs& in, std::size_t k) {
  return motion(in.rows[k].x_rad, in.rows[k].v_rad_s, in.rows[k].f_nm);
}
Motion<1> remote(const BlockInputs& in, std::size_t k) {
  return motion(in.rows[k].remote_x_rad, in.rows[k].remote_v_rad_s, in.rows[k].remote_f_nm);
}

template <class Each>
Cost each_tick(const BlockInputs& in, Each&& each) {
  return measure(in.rows.size(), [&] {
    for (std::size_t k = 0; k < in.rows.size(); ++k) each(k);
  });
}

AxisModel without_known(AxisModel model) {
  model.gravity = model.coulomb = 0;
  return model;
}
void through_rtob(const BlockInputs& in, Rtob<1>& rtob) {
  for (const StationSample& row : in.rows)
    keep(rtob.step(Joints<1>(row.command_nm), Joints<1>(row.x_rad), Joints<1>(row.v_rad_s)));
}
Cost rtob(const BlockInputs& in, const AxisModel& model, double dt_s) {
  Rtob<1> rtob(model, Cutoff::rad_s(200.0), dt_s);
  return measure(in.rows.size(), [&] { through_rtob(in, rtob); });
}
Cost part_of_rtob(const BlockInputs& in, const DriveParams& d, BlockId id) {
  AxisModel less = d.model;
  (id == BlockId::kWeight ? less.gravity : less.coulomb) = 0;
  Rtob<1> with(d.model, d.g_reac, d.dt_s), without(less, d.g_reac, d.dt_s);
  return difference(
      in.rows.size(), [&] { through_rtob(in, with); }, [&] { through_rtob(in, without); });
}

}  // namespace

Cost cost_of_block(BlockId id, const BlockInputs& in, const StationParams& p) {
  const DriveParams& d = p.control.drive;
  switch (id) {
    case BlockId::kVelocity: {
      Derivative<1> velocity(d.g_v, d.dt_s);
      return each_tick(in, [&](std::size_t k) { keep(velocity.step(Joints<1>(in.rows[k].x_rad))); });
    }
    case BlockId::kDob: {
      Dob<1> dob(d.model.J_n, d.g_dis, d.dt_s);
      return each_tick(
          in, [&](std::size_t k) { keep(dob.step(Joints<1>(in.rows[k].command_nm), Joints<1>(in.rows[k].v_rad_s))); });
    }
    case BlockId::kRtob:
      return rtob(in, without_known(d.model), d.dt_s);
    case BlockId::kWeight:
    case BlockId::kCoulomb:
      return part_of_rtob(in, d, id);
    case BlockId::kLaw:
      return each_tick(in, [&](std::size_t k) { keep(four_channel(d.K, local(in, k), remote(in, k))); });
    case BlockId::kCdob: {
      Cdob<1> cdob(d.K, p.control.law.g_net, p.control.law.local_model, d.dt_s);
      return each_tick(in, [&](std::size_t k) {
        cdob.step(local(in, k), remote(in, k));
        keep(cdob);
      });
    }
    case BlockId::kSdcv: {
      Sdcv<1> sdcv(p.control.law.sdcv, d.dt_s);
      return each_tick(in, [&](std::size_t k) { keep(sdcv.step(Joints<1>(in.rows[k].remote_f_nm))); });
    }
    case BlockId::kMediator: {
      Mediator<1> mediator(d.K, d.dt_s);
      mediator.reset(remote(in, 0));
      return each_tick(in, [&](std::size_t k) { keep(mediator.step(local(in, k), remote(in, k))); });
    }
    case BlockId::kScale:
      return each_tick(in, [&](std::size_t k) {
        const Motion<1> peer = remote(in, k);
        keep(Motion<1>{peer.x / p.scale.position, peer.v / p.scale.position, peer.f * p.scale.force});
      });
    case BlockId::kTwoChannel:
      return each_tick(in,
                       [&](std::size_t k) { keep(held_to(p.control.law.two_channel, local(in, k), remote(in, k))); });
    case BlockId::kWave: {
      ReceivedWave<1> received(d.dt_s);
      if (p.role == Role::kLeader) {
        MasterWave<1> wave(p.control.law.wave);
        return each_tick(in, [&](std::size_t k) {
          wave.step(local(in, k).v, received.step(remote(in, k).f, 1, false));
          keep(wave.sent());
        });
      }
      SlaveWave<1> wave(p.control.law.wave, d.dt_s);
      return each_tick(in, [&](std::size_t k) {
        wave.step(local(in, k), received.step(remote(in, k).f, 1, false), remote(in, k).x, 1);
        keep(wave.sent());
      });
    }
    case BlockId::kChooser: {
      Chooser chooser(d.dt_s);
      return each_tick(in, [&](std::size_t k) {
        chooser.step({.round_trip = in.rows[k].rtt_s, .loss = 0.0}, 1);
        keep(chooser.share());
      });
    }
    case BlockId::kTank: {
      EnergyTank tank(p.control.law.tank, kFastestDamper / d.K.K_f, d.dt_s);
      return each_tick(in, [&](std::size_t k) {
        tank.step(in.rows[k].command_nm * in.rows[k].v_rad_s * d.dt_s, 0.0, 1);
        keep(tank.share() + tank.damping());
      });
    }
    case BlockId::kPassivity: {
      PortPassivity port(kFastestDamper / d.K.K_f, d.dt_s);
      return each_tick(in, [&](std::size_t k) {
        const double power = in.rows[k].command_nm * in.rows[k].v_rad_s;
        port.step(power * d.dt_s, 0.0, 0.0);
        port.decide(power);
        keep(port.share() + port.damping());
      });
    }
    case BlockId::kTorqueGate: {
      TorqueGate<1> gate(d.gate, d.dt_s);
      return each_tick(
          in, [&](std::size_t k) { keep(gate.pass(Joints<1>(in.rows[k].command_nm), Joints<1>(in.rows[k].x_rad))); });
    }
    case BlockId::kReferenceGate: {
      ReferenceGate<1> gate(d.gate, d.dt_s);
      return each_tick(in, [&](std::size_t k) { keep(gate.pass(remote(in, k))); });
    }
    case BlockId::kBlend: {
      Blend<1> blend(p.blend_s, p.align_speed);
      blend.begin(local(in, 0), remote(in, 0));
      return each_tick(in, [&](std::size_t k) { keep(blend.step(remote(in, k), d.dt_s)); });
    }
    case BlockId::kEngagement: {
      Engagement engagement(p.role, p.engagement);
      return each_tick(in, [&](std::size_t k) {
        EngagementInputs inputs;
        inputs.peer_alive = true;
        inputs.peer = static_cast<StationState>(in.rows[k].state);
        keep(engagement.step(static_cast<Nanoseconds>(k) * from_seconds(d.dt_s), inputs));
      });
    }
    case BlockId::kGuard: {
      PatientGuard<1> guard(p.guard, d);
      Motion<1> followed;
      return each_tick(in, [&](std::size_t k) {
        const GuardVerdict verdict = guard.step({.local = local(in, k),
                                                 .reference = followed,
                                                 .torque = Joints<1>(in.rows[k].command_nm),
                                                 .device = {},
                                                 .driven = true,
                                                 .engaged = true});
        followed = guard.allow(local(in, k), remote(in, k), verdict.gain);
        keep(followed);
      });
    }
    default:
      return {};
  }
}

}  // namespace farhand
