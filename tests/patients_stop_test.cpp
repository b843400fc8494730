// The patient's stop through its three ways, in virtual time: how long until the MCU commands no torque, with the
// network and without, with a free serial line and one that is full, and that nobody but the patient's side ends it.
// (The MCU's input alone is in mcu_stop_test.cpp; real time in stop_latency_test.cpp.)
#include "common/config/world_params.hpp"
#include "common/device/simulated_axis.hpp"
#include "tests/support/patients_box.hpp"

namespace farhand {
namespace {

enum class Way { kKey, kPedal, kPedalsEnd, kMcuInput };
constexpr const char* kWays[] = {"key", "pedal", "the pedal's end", "input of the MCU"};

void press(Box& box, Way way) {
  if (way == Way::kKey) box.keys.say("hold\nstop\n");
  if (way == Way::kPedal) box.pedal.say("x");
  if (way == Way::kPedalsEnd) box.pedal.finish();
  if (way == Way::kMcuInput) box.orthosis.on_serial.emulator().press_stop(true);
}

// As if the adapter had stood still: thirty frames before the next one, all of them good.
void fill_the_line(Box& box) {
  mcu::Command command = mcu::make_command(mcu::Mode::kTrack, 0, 0.15, 0, -0.75);
  for (int k = 0; k < 30; ++k) {
    std::uint8_t wire[mcu::kWireBytes];
    command.seq = static_cast<std::uint8_t>(k & 15);
    mcu::encode(command, wire);
    box.orthosis.on_serial.send(wire, sizeof wire, box.now);
  }
}

// From now on to the first MCU loop that commands no torque.
Nanoseconds until_no_torque(Box& box) {
  const Nanoseconds from = box.now;
  while (box.now < from + kSecond) {
    box.orthosis.on_serial.advance(box.now + kMillisecond / 2);
    if (box.torque() == 0) return box.now + kMillisecond / 2 - from;
    box.tick();
    if (box.torque() == 0) return box.now - from;
  }
  return -1;
}

// The worst moment to press is just after a tick: then the host reads it a millisecond later. From there on it is the
// time of one frame on the line and 2 ms; the MCU's own input waits for half a millisecond at most.
TEST(PatientsStop, LeavesNoTorqueOneFrameAndTwoMillisecondsLater) {
  for (const Way way : {Way::kKey, Way::kPedal, Way::kPedalsEnd, Way::kMcuInput}) {
    for (const bool network : {true, false}) {
      for (const bool full : {false, true}) {
        Box box;
        ASSERT_TRUE(box.engage());
        box.network = network;
        if (!network) box.ticks(50);
        ASSERT_EQ(box.state(), S::kEngaged);
        if (full) fill_the_line(box), box.ticks(3);
        ASSERT_GT(std::abs(box.torque()), 0.3);
        press(box, way);
        const Nanoseconds took = until_no_torque(box);
        std::printf("%-16s  network %-4s  line %-4s  %.1f ms after the press\n", kWays[static_cast<int>(way)],
                    network ? "up" : "down", full ? "full" : "free", 1e3 * to_seconds(took));
        EXPECT_GE(took, 0);
        const Nanoseconds read = way == Way::kMcuInput ? kMillisecond / 2 : kMillisecond;
        EXPECT_LE(took - read, (way == Way::kMcuInput ? 0 : kSerial) + 2 * kMillisecond);
        box.network = true;
        for (int k = 0; k < 1500; ++k) {
          box.tick();
          ASSERT_EQ(box.torque(), 0);
          ASSERT_NE(box.state(), S::kEngaged);
        }
      }
    }
  }
}

TEST(PatientsStop, IsEndedByThePatientsSideOnlyAndThenNothingMovesByItself) {
  for (const Way way : {Way::kKey, Way::kPedal, Way::kMcuInput}) {
    SCOPED_TRACE(kWays[static_cast<int>(way)]);
    Box box;
    ASSERT_TRUE(box.engage());
    press(box, way);
    for (int k = 0; k < 3000; ++k) {  // the therapist lets go, and engages again
      box.says = k < 1500 ? S::kReady : S::kEngaged;
      box.tick();
      ASSERT_NE(box.state(), S::kEngaged);
    }
    EXPECT_EQ(box.torque(), 0);
    OrthosisEmulator& mcu = box.orthosis.on_serial.emulator();
    mcu.press_stop(false), box.ticks(10);
    mcu.press_release(way == Way::kMcuInput), box.ticks(200), mcu.press_release(false);
    box.keys.say("reset\n");
    for (int k = 0; k < 1500; ++k) {
      box.tick();
      ASSERT_EQ(box.torque(), 0);
    }
    EXPECT_TRUE(box.engage());
  }
}

// Pressed again while it is reset, and pressed for good.
TEST(PatientsStop, IsNotResetWhileItIsPressed) {
  Box box;
  ASSERT_TRUE(box.engage());
  press(box, Way::kPedalsEnd);
  for (int k = 0; k < 4000; ++k) {
    if (k % 100 == 0) box.keys.say("reset\n");
    box.says = k < 2000 ? S::kReady : S::kEngaged;
    box.tick();
    ASSERT_NE(box.state(), S::kEngaged);
  }
  EXPECT_EQ(box.torque(), 0);
}

// A motor that is commanded by its torque: none in the same tick. One that slept has no MCU to let go for it, and its
// socket is full of packets too young to be expired.
class DirectBox {
 public:
  DirectBox() {
    for (int k = 0; k < 3000; ++k) tick(k < 1200 ? S::kReady : S::kEngaged);
    EXPECT_EQ(side.trace().state, S::kEngaged);
    EXPECT_GT(std::abs(side.trace().effort), 0.3);
  }
  void send(S says) {
    now += kMillisecond;
    packet.seq += 1, packet.send_time_ns = now, packet.state = says;
    packet.motion.x[0] = says == S::kEngaged ? std::min(0.2, packet.motion.x[0] + 2e-4) : 0.0;
    packet.motion.f[0] = -5 * packet.motion.x[0];
    socket.push_back(packet);
  }
  void run(OperatorAct act = OperatorAct::kNone, int ticks = 1) {
    for (; !socket.empty(); socket.pop_front()) side.receive(socket.front(), now);
    side.tick(now, to_seconds(now), act, ticks);
  }
  void tick(S says, OperatorAct act = OperatorAct::kNone) { send(says), run(act); }

  LoadedScene scene = load_scene("four_channel", std::vector<std::string>{"slave.hand={stiffness_nm_per_rad: 5}"});
  SideOf<SimulatedAxis<DirectSlaveWorld>> side{slave_station_params(scene.scene, 2),
                                               direct_slave_world_params(scene.scene), world_numerics(scene.scene)};
  Packet<1> packet{.session = 1, .motion = {}};
  std::deque<Packet<1>> socket;
  Nanoseconds now = 0;
};

TEST(PatientsStop, OfADirectDriveLeavesNoTorqueInTheSameTick) {
  DirectBox box;
  box.tick(S::kEngaged, OperatorAct::kStop);
  EXPECT_EQ(box.side.trace().effort, 0.0);
  for (int k = 0; k < 3000; ++k) {
    box.tick(k < 1500 ? S::kReady : S::kEngaged);
    ASSERT_EQ(box.side.trace().effort, 0.0);
  }
}

TEST(TimersFed, ADirectDriveThatSleptHoldsWhereItIs) {
  for (const int ms : {101, 150, 1000, 1900}) {
    DirectBox box;
    for (int k = 0; k < ms; ++k) box.send(S::kEngaged);
    box.run(OperatorAct::kNone, ms);
    EXPECT_EQ(box.side.trace().state, S::kHolding) << ms;
    EXPECT_EQ(box.side.trace().reason, Reason::kPeerSilent);
    for (int k = 0; k < 2000; ++k) {
      box.tick(S::kEngaged);
      ASSERT_EQ(box.side.trace().state, S::kHolding) << ms;
    }
  }
}

}  // namespace
}  // namespace farhand
