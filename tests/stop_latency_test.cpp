// How long from the press of the patient's stop until the MCU commands no torque, in real time: the programs of the
// patient's box with the network down, timed by the emulated MCU's own recording. Printed and not judged: machines
// stall. (The promise in virtual time is in patients_stop_test.cpp.)
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <thread>

#include "common/link/codec.hpp"
#include "common/link/udp.hpp"
#include "common/record/session_file.hpp"
#include "common/runtime/run_loop.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

constexpr const char* kWays[] = {"key", "pedal", "input of the MCU"};

class PatientsStopInRealTime : public testing::Test {
 protected:
  PatientsStopInRealTime() {
    EXPECT_EQ(mkfifo(pedal_path_.c_str(), 0600), 0);
    pedal_ = open(pedal_path_.c_str(), O_RDWR | O_CLOEXEC);
    mcu_ = start({path_of(Program::kMcu), "--link", line_, "--record", (scratch_ / "mcu.mcap").string()}, {});
    EXPECT_NE(mcu_->read_line(), "");
    box_ = start({path_of(Program::kSlave), "--peer", to_string(socket_.local_endpoint()), "--insecure", "--serial",
                  line_, "--quiet", "--stop-input", pedal_path_},
                 slave_environment());
  }
  ~PatientsStopInRealTime() override { close(pedal_); }

  // The therapist, for so long: Ready is heard where the hand is, Engaged leads it to 0.15 rad.
  void therapist(StationState says, Nanoseconds duration) {
    PacketCodec<1> codec;
    alignas(8) std::array<std::byte, 2048> buffer;
    const Nanoseconds from = monotonic_now();
    for (Nanoseconds now = from; now < from + duration; now = monotonic_now()) {
      while (const auto datagram = socket_.receive(buffer)) {
        Packet<1> packet;
        if (codec.decode(std::span(buffer).first(datagram->size), packet) != DecodeResult::kOk) continue;
        socket_.accept(datagram->sender);
        slave_ = packet;
      }
      if (says != StationState::kEngaged) x_ = slave_.motion.x[0];
      packet_.seq += 1, packet_.send_time_ns = now, packet_.state = says, packet_.expiry_ms = 2000;
      const double ahead = std::min(1.0, to_seconds(now - from));
      packet_.motion.x[0] = says == StationState::kEngaged ? x_ + 0.15 * ahead * ahead * (3 - 2 * ahead) : x_;
      packet_.motion.f[0] = -5 * packet_.motion.x[0];
      socket_.send(codec.encode(packet_));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  Recorded recorded() const {
    const auto file = scratch_ / "mcu.mcap";
    return read_recording(std::filesystem::exists(file) ? file : std::filesystem::path(file.string() + ".part"));
  }

  // The first record at or after `t` that satisfies it; waits until the recorder has written it.
  template <class Condition>
  Nanoseconds first_record(Nanoseconds t, Condition condition) {
    Nanoseconds at = -1;
    comes_true(
        [&] {
          for (const auto& [stamp, sample] : recorded().mcu) {
            if (stamp >= t && condition(sample)) return at = stamp, true;
          }
          return false;
        },
        5);
    return at;
  }

  void press(std::size_t way) {
    if (way == 0) box_->say("stop\n");
    if (way == 1 && write(pedal_, "x", 1) != 1) ADD_FAILURE();
    if (way == 2) mcu_->send_signal(SIGUSR1);
  }

  void measure(int presses) {
    std::array<std::vector<double>, 3> took_ms;
    for (int k = 0, attempts = 0; k < presses && attempts < 3 * presses; ++attempts) {
      const auto way = static_cast<std::size_t>(k) % 3;
      therapist(StationState::kReady, 1150 * kMillisecond);
      therapist(StationState::kEngaged, 1000 * kMillisecond);
      std::this_thread::sleep_for(std::chrono::milliseconds(130));  // the network is down, the box holds
      const Nanoseconds pressed = monotonic_now();
      press(way);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      const Nanoseconds off =
          first_record(pressed, [](const McuSample& sample) { return sample.torque_command_nm == 0; });
      double before = 0;
      for (const auto& [stamp, sample] : recorded().mcu) {
        if (stamp <= pressed) before = sample.torque_command_nm;
      }
      if (way == 2) mcu_->send_signal(SIGUSR2);
      therapist(StationState::kReady, 300 * kMillisecond);
      box_->say("reset\n");
      if (std::abs(before) < 0.1) continue;  // a busy machine let go by itself
      ASSERT_GE(off, 0) << box_->err();
      took_ms[way].push_back(1e3 * to_seconds(off - pressed));
      ++k;
    }
    for (std::size_t way = 0; way < took_ms.size(); ++way) {
      std::vector<double>& times = took_ms[way];
      ASSERT_FALSE(times.empty()) << box_->err();
      std::sort(times.begin(), times.end());
      std::printf("%-16s  %2zu presses: median %.1f ms, worst %.1f ms\n", kWays[way], times.size(),
                  times[times.size() / 2], times.back());
    }
    box_->send_signal(SIGTERM);
    box_->wait();
    mcu_->send_signal(SIGTERM);
    mcu_->wait();
  }

  static std::unique_ptr<ChildProcess> start(std::vector<std::string> command,
                                             const std::vector<std::string>& environment) {
    for (const char* word : {"--scene", "sea_four_channel", "--set", "slave.hand={stiffness_nm_per_rad: 5}", "--set",
                             "duration_s=3600", "--set", "runtime.priority=20"}) {
      command.emplace_back(word);
    }
    return std::make_unique<ChildProcess>(command, environment);
  }

  ScratchDirectory scratch_;
  std::string pedal_path_ = (scratch_ / "pedal").string(), line_ = (scratch_ / "line").string();
  int pedal_ = -1;
  UdpSocket socket_ = UdpSocket::listen(parse_endpoint("127.0.0.1:0", EndpointUse::kListen));
  std::unique_ptr<ChildProcess> mcu_, box_;
  Packet<1> packet_{.session = 1, .motion = {}}, slave_;
  double x_ = 0;
};

TEST_F(PatientsStopInRealTime, IsMeasured) { measure(3); }

using NightlyPatientsStopInRealTime = PatientsStopInRealTime;
TEST_F(NightlyPatientsStopInRealTime, IsMeasured) { measure(20); }

}  // namespace
}  // namespace farhand
