// Two stations as a library, without a file, a socket or a clock: a therapist's motor leads a patient's over 30 ms.
#include <cstdio>
#include <deque>
#include <utility>

#include "common/runtime/owned_station.hpp"

using namespace farhand;

struct MotorInHand {  // 4 g m2, held by a spring and a damper
  double x = 0, v = 0, rest = 0, stiffness = 0;
  void go_on_for_1_ms(double torque) {
    for (int k = 0; k < 20; ++k) x += 5e-5 * (v += 5e-5 * (torque + stiffness * (rest - x) - 0.05 * v) / 4e-3);
  }
};

int main() {
  StationParams p, q;
  p.role = Role::kLeader, p.architecture = "MODEL_MEDIATED", p.session = 1;
  q.role = Role::kFollower, q.architecture = "MODEL_MEDIATED", q.session = 2;
  OwnedStation<DirectIo<1>> master(p), slave(q);
  MotorInHand therapist{.stiffness = 3}, patient{.stiffness = 2};
  std::deque<std::pair<Nanoseconds, Packet<1>>> there, back;
  for (Nanoseconds now = 0; now < 8 * kSecond; now += kMillisecond) {
    for (; !back.empty() && back.front().first <= now; back.pop_front()) master.receive(back.front().second, now);
    for (; !there.empty() && there.front().first <= now; there.pop_front()) slave.receive(there.front().second, now);
    const OperatorAct act = now == kSecond ? OperatorAct::kEngage : OperatorAct::kNone;
    const auto m = master.tick(now, {.x = Joints<1>(therapist.x), .valid = true}, act);
    const auto s = slave.tick(now, {.x = Joints<1>(patient.x), .valid = true});
    there.emplace_back(now + 30 * kMillisecond, m.packet);
    back.emplace_back(now + 30 * kMillisecond, s.packet);
    therapist.rest = now > 4 * kSecond ? 0.2 : 0.0;  // the therapist moves
    therapist.go_on_for_1_ms(m.command.torque[0]);
    patient.go_on_for_1_ms(s.command.torque[0]);
  }
  std::printf("%s; therapist at %.3f rad feels %.3f N m, patient at %.3f rad is given %.3f N m\n",
              name_of(slave.state()), therapist.x, -master.trace().local.f[0], patient.x, slave.trace().local.f[0]);
}
