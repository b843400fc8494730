#include "netem/lab/explain_blocks.hpp"

#include "common/law/acceleration_law.hpp"
#include "common/law/architectures.hpp"
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

// What a side saw, as its law is told of it.
struct SeenByLaw {
  SeenByLaw(const BlockInputs& in, double dt_s) {
    for (std::size_t k = 0; k < in.rows.size(); ++k) {
      const StationSample& row = in.rows[k];
      networks.push_back({.round_trip = row.rtt_s, .loss = 0.0});
      LawInputs<1> inputs;
      inputs.local = local(in, k);
      inputs.received = remote(in, k);
      inputs.engaged = true;
      inputs.account = {.torque = Joints<1>(row.command_nm), .moved = Joints<1>(row.v_rad_s * dt_s), .engaged = true};
      ticks.push_back(inputs);
    }
    for (std::size_t k = 0; k < ticks.size(); ++k) ticks[k].network = &networks[k];
  }
  std::vector<NetworkNow> networks;
  std::vector<LawInputs<1>> ticks;
};

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

const LawMaker& maker_of(const BlockInputs& in, const StationParams& p) {
  const Architecture& laws = architecture(p.architecture);
  return in.master ? laws.master : laws.slave;
}

Cost law_block(const std::string& name, const BlockInputs& in, const StationParams& p) {
  const LawBlock* block = block_of(maker_of(in, p), name);
  if (block == nullptr || block->run == nullptr) return {};
  const DriveParams& d = p.control.drive;
  const SeenByLaw seen(in, d.dt_s);
  return measure(in.rows.size(), [&] { keep(block->run(p.control.law, d.K, d.dt_s, seen.ticks)); });
}

}  // namespace

Cost cost_of_law(const BlockInputs& in, const StationParams& p) {
  const DriveParams& d = p.control.drive;
  const auto law = maker_of(in, p).make(p.control.law, d.K, d.dt_s);
  const SeenByLaw seen(in, d.dt_s);
  if (!seen.ticks.empty()) law->start(seen.ticks.front());
  return each_tick(in, [&](std::size_t k) { keep(law->step(seen.ticks[k])); });
}

Cost cost_of_block(const Block& block, const BlockInputs& in, const StationParams& p) {
  const BlockId id = block.id;
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
    case BlockId::kLawBlock:
      return law_block(block.name, in, p);
    case BlockId::kScale:
      return each_tick(in, [&](std::size_t k) {
        const Motion<1> peer = remote(in, k);
        keep(Motion<1>{peer.x / p.scale.position, peer.v / p.scale.position, peer.f * p.scale.force});
      });
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
