// One real side of a session in virtual time against a peer that says whatever a test wants: authentic, in time, in
// order.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/runtime/side.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

class ScriptedPeer {
 public:
  // Says: changes what an honest peer would send now; false: says nothing.
  using Says = std::function<bool(Packet<1>&, const Side&, double t_s)>;

  // patient: the patient's box is real and the peer a therapist's station; else the other way round.
  ScriptedPeer(const std::string& scene, const std::vector<std::string>& sets, bool patient)
      : scene_(load_scene(scene, sets).scene), patient_(patient) {
    Sides sides = make_sides(scene_);
    side_ = std::move(patient ? sides.slave : sides.master);
  }

  Side& side() noexcept { return *side_; }
  const scene::Scene& scene() const noexcept { return scene_; }
  double t_s() const noexcept { return 1e-3 * static_cast<double>(ticks_); }

  // Honest: where the side is, at rest, without torque; ready for 0.4 s, then engaged.
  void tick(const Says& says = {}) {
    const Nanoseconds now = ticks_ * kMillisecond;
    Packet<1> packet;
    packet.session = 77;
    packet.seq = static_cast<std::uint32_t>(ticks_ + 1);
    packet.send_time_ns = now;
    packet.expiry_ms = 2000;
    packet.motion.x = side_->trace().local.x;
    const bool engaging = ticks_ >= 400;
    OperatorAct act = OperatorAct::kNone;
    if (patient_) {
      packet.state =
          ticks_ < 1200 ? (engaging ? StationState::kAligning : StationState::kReady) : StationState::kEngaged;
    } else {
      if (ticks_ == 1200) act = OperatorAct::kEngage;
      packet.state = side_->trace().state == StationState::kEngaged ? StationState::kEngaged : StationState::kReady;
    }
    if (!says || says(packet, *side_, t_s())) side_->receive(packet, now);
    side_->tick(now, t_s(), act, 1);
    ++ticks_;
  }
  void until(double t_s, const Says& says = {}) {
    while (this->t_s() < t_s) tick(says);
  }

 private:
  scene::Scene scene_;
  bool patient_;
  std::unique_ptr<Side> side_;
  std::int64_t ticks_ = 0;
};

}  // namespace farhand
