// Rogue peers against the real programs: the peer of a genome has the pairing key, shakes hands and speaks over the
// secured link, in time, to a slave with its simulated world, to a slave behind the emulated MCU on a pseudo terminal,
// or to a master. What happened to the person is read from the recordings, which hold the truth of the simulated world.
//
// A machine that stalls lets a simulated direct drive hold its last torque, and a peer speak late: such a run says
// nothing about virtual time's, so it is done again. Behind the emulated MCU a stall ends in the MCU's own let-go.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

#include "common/config/load.hpp"
#include "common/link/codec.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/secure/pairing_key.hpp"
#include "netem/lab/rogue_link.hpp"
#include "netem/lab/rogue_peer.hpp"
#include "netem/lab/rogue_report.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand::rogue {
namespace {

constexpr double kOfTheSame = 1.2;  // of the bounds of virtual time
constexpr Nanoseconds kStall = 8 * kMillisecond;
constexpr int kTries = 4;

struct Run {
  Findings findings;
  double engaged_s = 0;
  Nanoseconds longest_gap = 0;  // of the tested program or of the peer
};

class RealSession {
 public:
  explicit RealSession(const Row& row)
      : row_(row), arena_(row.cell), plan_(arena_.plan_of(row.genome)), scene_(arena_.scene_of(plan_)) {
    plan_.network_s = 0;
    scene_.set_duration_s(60);
    write_bytes(scratch_ / "rogue.txtpb", complete_text(scene_));
    store_key(scratch_ / "key", PairingKey::random(), ExistingKey::kRefuse);
  }

  Run run() {
    const bool therapist = row_.cell.against == Against::kTherapist, mcu = row_.cell.device != Device::kDirect;
    std::unique_ptr<PeerLink> link;
    if (therapist) {
      tested_ = start(Program::kMaster, {"--listen", "127.0.0.1:0"}, {});
      const std::string line = tested_->read_line();
      if (!line.starts_with("listening ")) throw std::runtime_error("no master: " + tested_->err());
      link = open_rogue_link(key(), line.substr(10), Role::kFollower, scene_);
    } else {
      link = open_rogue_link(key(), "127.0.0.1:0", Role::kLeader, scene_);
      std::vector<std::string> more{"--peer", to_string(link->socket().local_endpoint())};
      std::vector<std::string> environment;
      if (mcu) {
        const std::string serial = (scratch_ / "line").string();
        mcu_ = std::make_unique<ChildProcess>(std::vector<std::string>{path_of(Program::kMcu), "--scene", scene(),
                                                                       "--link", serial, "--record",
                                                                       (scratch_ / "mcu.mcap").string()});
        if (!mcu_->read_line().starts_with("serial ")) throw std::runtime_error("no MCU: " + mcu_->err());
        more.insert(more.end(), {"--serial", serial});
        environment = slave_environment();
      }
      tested_ = start(Program::kSlave, more, environment);
    }
    speak(*link);
    for (ChildProcess* child : {tested_.get(), mcu_.get()}) {
      if (child == nullptr) continue;
      child->send_signal(SIGTERM);
      child->wait();
    }
    return judged();
  }

 private:
  std::string key() const { return (scratch_ / "key").string(); }
  std::string scene() const { return (scratch_ / "rogue.txtpb").string(); }
  std::string recording() const { return (scratch_ / "tested.mcap").string(); }

  std::unique_ptr<ChildProcess> start(Program program, const std::vector<std::string>& more,
                                      const std::vector<std::string>& environment) {
    std::vector<std::string> command{path_of(program), "--scene",  scene(),    "--key", key(),
                                     "--quiet",        "--record", recording()};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<ChildProcess>(command, environment);
  }

  // The peer, in time, from the first packet of the tested side on.
  void speak(PeerLink& link) {
    const auto architecture = row_.cell.architecture;
    PacketCodec<1> codec(
        {.energy = architecture == scene::FOUR_CHANNEL_TANK || architecture == scene::TWO_CHANNEL_PO_PC,
         .previous = architecture == scene::MODEL_MEDIATED || architecture == scene::AUTOMATIC});
    Peer peer(plan_, row_.cell.against, 1);
    Seen seen;
    bool heard = false;
    std::uint32_t hellos = 0;
    const Nanoseconds start = monotonic_now();
    Nanoseconds first = 0, last = start;
    double engage_s = 0;
    alignas(8) std::array<std::byte, 2048> buffer;
    for (Nanoseconds next = start;; next += kMillisecond) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::max<Nanoseconds>(0, next - monotonic_now())));
      const Nanoseconds now = monotonic_now();
      if (heard) peer_gap_ = std::max(peer_gap_, now - last);
      last = now;
      if (now - start > 30 * kSecond) break;
      link.advance(now);
      std::span<const std::byte> datagram;
      for (int k = 0; k < 200; ++k) {
        const PeerLink::Received received = link.receive(buffer, now, datagram);
        if (received == PeerLink::Received::kNothing) break;
        Packet<1> packet;
        if (received != PeerLink::Received::kPacket || codec.decode(datagram, packet) != DecodeResult::kOk) continue;
        if (!heard) first = now;
        heard = true;
        seen.packet = packet;
        seen.state = packet.state;
        seen.x = packet.motion.x[0];
        seen.v = packet.motion.v[0];
        seen.f = packet.motion.f[0];
      }
      if (!heard) {  // a master waits for its box's first word
        Packet<1> hello;
        hello.session = 1;
        hello.seq = ++hellos;
        hello.send_time_ns = now;
        hello.expiry_ms = 2000;
        if (row_.cell.against == Against::kTherapist) link.send(codec.encode(hello));
        continue;
      }
      seen.t_s = to_seconds(now - first);
      const bool ready = seen.state == StationState::kReady || seen.state == StationState::kHolding;
      if (row_.cell.against == Against::kTherapist && ready && seen.t_s > engage_s + 0.2 &&
          (engage_s == 0 || plan_.engages_again)) {
        engage_s = seen.t_s;
        tested_->say("engage\n");
      }
      for (const Packet<1>& packet : peer.tick(seen)) {
        link.send(codec.encode(packet));
        last_packet_ = now;
      }
      const double end =
          peer.engaged_once() ? peer.engaged_from_s() + plan_.attack_s + (plan_.falls_silent ? 1.6 : 0.1) : 8.0;
      if (seen.t_s > end) break;
    }
  }

  Run judged() const {
    Run run;
    Judge judge(allowed_of(scene_, row_.cell, plan_));
    // Where its host stalls the emulated orthosis stands still, so its time is not that of the clock.
    Nanoseconds stood = 0, mcu_before = 0;
    const auto time_of = [&](Nanoseconds t) { return to_seconds(t - stood); };
    const Recorded tested = read_recording(recording());
    const auto& rows = row_.cell.against == Against::kTherapist ? tested.master : tested.slave;
    Recorded::Series<McuSample> truth;
    if (mcu_ != nullptr) truth = read_recording(scratch_ / "mcu.mcap").mcu;
    auto at_mcu = truth.begin();
    StationState state = StationState::kOff;
    Nanoseconds before = 0;
    for (const auto& [t, row] : rows) {
      if (t <= last_packet_) judge.last_packet(time_of(t));
      if (before > 0) run.longest_gap = std::max(run.longest_gap, t - before);
      before = t;
      for (; at_mcu != truth.end() && at_mcu->first <= t; ++at_mcu) {
        const McuSample& mcu = at_mcu->second;
        const Nanoseconds gap = at_mcu->first - mcu_before;
        if (mcu_before > 0 && gap > 3 * kMillisecond + kMillisecond / 2) stood += gap - kMillisecond;
        mcu_before = at_mcu->first;
        judge.see({.t_s = time_of(at_mcu->first),
                   .body = {mcu.true_x_rad, mcu.true_v_rad_s, mcu.motor_x_rad, 0},
                   .torque = mcu.true_f_nm,
                   .spring = mcu.spring_torque_nm,
                   .commanded = mcu.torque_command_nm,
                   .driven = drives(state)});
      }
      if (mcu_ == nullptr) {
        judge.see({.t_s = time_of(t),
                   .body = {row.true_x_rad, row.true_v_rad_s, 0, 0},
                   .torque = row.true_f_nm,
                   .commanded = row.command_nm,
                   .driven = drives(state)});
      }
      state = static_cast<StationState>(row.state);
      TickTrace<1> trace;
      trace.state = state;
      trace.local.x[0] = row.x_rad, trace.local.v[0] = row.v_rad_s;
      trace.target.x[0] = row.target_x_rad;
      trace.target.v[0] = row.v_rad_s;
      judge.see(trace, time_of(t));
    }
    run.findings = judge.findings();
    run.engaged_s = judge.engaged_s();
    run.longest_gap = std::max(run.longest_gap, peer_gap_);
    return run;
  }

  Row row_;
  Arena arena_;
  Plan plan_;
  scene::Scene scene_;
  ScratchDirectory scratch_;
  std::unique_ptr<ChildProcess> tested_, mcu_;
  Nanoseconds last_packet_ = 0, peer_gap_ = 0;
};

// The rows that real programs can play: nobody lies on a pseudo terminal.
std::vector<Row> real_rows() {
  std::vector<Row> rows;
  std::ifstream file(FARHAND_ROGUE_ROWS);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const Row row = row_of(line);
    if (row.cell.device != Device::kLyingMcu) rows.push_back(row);
  }
  return rows;
}

// Told is what virtual time and processes measured.
void expect_within(const Row& row) {
  const Outcome lab = Arena(row.cell).run(row.genome);
  for (int n = 0; n < kTries; ++n) {
    const Run real = RealSession(row).run();
    std::printf("%s: engaged for %.3f s, longest gap %.1f ms\n", name_of(row.cell).c_str(), real.engaged_s,
                1e3 * to_seconds(real.longest_gap));
    for (std::size_t k = 0; k < kLines; ++k) {
      std::printf("  %-24s lab %10.4g  processes %10.4g  bound %10.4g %s\n", name_of(static_cast<Line>(k)),
                  lab.findings[k].value, real.findings[k].value, real.findings[k].bound, unit_of(static_cast<Line>(k)));
    }
    const bool stalled = row.cell.device == Device::kDirect && real.longest_gap > kStall;
    if (stalled || real.engaged_s == 0) continue;
    for (std::size_t k = 0; k < kBoundLines; ++k) {
      if (static_cast<Line>(k) == Line::kJump) continue;  // its velocities are not in a recording
      EXPECT_LE(real.findings[k].ratio, kOfTheSame) << name_of(static_cast<Line>(k)) << " of " << text_of(row);
    }
    return;
  }
  GTEST_SKIP() << "the machine stalled in each of " << kTries << " runs";
}

TEST(RogueProcesses, TheWorstRowIsNoWorseOverTheSecuredLink) {
  const std::vector<Row> rows = real_rows();
  ASSERT_GE(rows.size(), 5u);
  expect_within(rows[0]);
}

TEST(NightlyRogueProcesses, TheWorstFiveAreNoWorseOverTheSecuredLinkAndThePtyMcu) {
  const std::vector<Row> rows = real_rows();
  ASSERT_GE(rows.size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) expect_within(rows[k]);
}

}  // namespace
}  // namespace farhand::rogue
