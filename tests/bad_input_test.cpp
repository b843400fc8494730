// What the programs say to a wrong argument, a missing or busy port and an unreadable file: exit 2 and one sentence,
// before anything is opened to others. And how they end on a signal, or without a peer. (farhand-netem's own arguments
// are in netem_process_test.cpp.)
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "common/device/pty.hpp"
#include "common/link/packet.hpp"
#include "common/link/udp.hpp"
#include "common/station/states.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

using Arguments = std::vector<std::string>;

constexpr const char* kNobody = "127.0.0.1:9";  // the discard service, which nobody runs

struct Case {
  Program program;
  Arguments arguments;
  std::string says;
};

// What a test says nothing about is not secured.
void choose_link(Program program, Arguments& command) {
  const bool station = program == Program::kMaster || program == Program::kSlave;
  const bool chosen = std::find(command.begin(), command.end(), "--key") != command.end();
  if (station && !chosen) command.push_back("--insecure");
}

// Somebody else than who built the programs: they lie where everybody may read them, and he needs no modem lines.
struct SomebodyElse {
  Arguments step_down;  // the command that makes him so
  std::filesystem::path programs;
};

void expect_refused(const Case& one, const SomebodyElse* who = nullptr) {
  Arguments command = who != nullptr ? who->step_down : Arguments{};
  const std::filesystem::path program = path_of(one.program);
  command.push_back(who != nullptr ? (who->programs / program.filename()).string() : program.string());
  command.insert(command.end(), one.arguments.begin(), one.arguments.end());
  choose_link(one.program, command);
  ChildProcess child(command, who != nullptr ? std::vector<std::string>{} : slave_environment());
  EXPECT_EQ(child.wait(), 2) << one.says;
  const std::string err = child.err();
  EXPECT_NE(err.find(one.says), std::string::npos) << "expected '" << one.says << "' in: " << err;
  EXPECT_TRUE(err.starts_with(std::string("farhand-") + role_of(one.program) + ": ")) << err;
  EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  EXPECT_EQ(child.out(), "") << "it must not announce itself first";
}

// The rest of a good command line, for the mistakes that every program may meet.
Arguments rest_of(Program program, const ScratchDirectory& scratch) {
  if (program == Program::kMcu) return {"--link", (scratch / "line").string()};
  if (program == Program::kMaster) return {"--listen", "127.0.0.1:0"};
  if (program == Program::kNetem) return {"--listen", "127.0.0.1:0", "--forward", kNobody};
  return {"--peer", kNobody, "--serial", (scratch / "line").string()};
}

TEST(BadInput, EveryProgramRefusesAWrongScene) {
  ScratchDirectory scratch;
  write_bytes(scratch / "typo.txtpb", "architecture: FOUR_CHANNEL\nduration_s: 3 sped: 1\n");
  const std::string typo = (scratch / "typo.txtpb").string(), directory = scratch.path().string() + "/";
  for (const Program program : kPrograms) {
    const auto with = [&](const Arguments& more) {
      Arguments all = rest_of(program, scratch);
      all.insert(all.end(), more.begin(), more.end());
      return all;
    };
    expect_refused({program, with({}), "--scene is required"});
    expect_refused({program, with({"--scene", "demoo"}), "there is no scene 'demoo'"});
    expect_refused({program, with({"--scene", "demoo"}), "did you mean 'demo'?"});
    expect_refused({program, with({"--scene", typo}), typo + ":2:15: there is no field 'sped'"});
    expect_refused({program, with({"--scene", directory}), "is a directory"});
    for (const std::string stalls : {"master.host", "slave.host"}) {
      expect_refused({program, with({"--scene", "demo", "--set", stalls + "={stall_s: 0.008}"}),
                      stalls + " has no effect: it needs virtual time"});
    }
    expect_refused({program, with({"--scene", "zero_delay", "--set", "tick_s=0.02"}),
                    "tick_s = 0.02 s: the limits at the two persons hold up to 0.005 s"});
    expect_refused({program, with({"--scene", "zero_delay", "--set", "control.g_reac_rad_s=10"}),
                    "control.g_reac_rad_s = 10 rad/s: the limits at the two persons hold from 50 rad/s"});
    expect_refused({program, with({"--scene", ""}), "--scene is given nothing"});
    expect_refused({program, with({"--scene", "demo", "--record", ""}), "--record is given nothing"});
    expect_refused({program, with({"--scene", "demo", "--record="}), "--record is given nothing"});
    expect_refused({program, with({"--scene", directory + "none.txtpb"}), "No such file or directory"});
    expect_refused({program, with({"--scene", "demo", "--set", "network.forward.loss=2"}),
                    "network.forward.loss = 2 is not allowed; give a value from 0 to 1"});
    expect_refused({program, with({"--scene", "demo", "--set", "control.K_q=1"}), "no field 'K_q'"});
    expect_refused({program, with({"--scene", "demo", "--seed", "many"}), "--seed"});
    expect_refused({program, with({"--scene", "demo", "--fast"}), "--fast"});
  }
}

TEST(BadInput, WhatTheMcuCannotCarryIsRefusedByTheNameOfItsField) {
  ScratchDirectory scratch;
  const auto refused = [&](const std::string& set, const std::string& sentence) {
    Arguments all = rest_of(Program::kMcu, scratch);
    all.insert(all.end(), {"--scene", "sea_four_channel_mediated", "--set", set});
    expect_refused({Program::kMcu, all, sentence});
  };
  refused("slave.mcu.loop_hz=1500", "slave.mcu.loop_hz does not fit the MCU: loop_hz must be a multiple of 1000 Hz");
  refused("slave.axis.torque_limit_nm=50", "slave.axis.torque_limit_nm does not fit the MCU: torque_limit = 50");
  refused("slave.series_elastic.motor_speed_limit_rad_s=1000", "slave.series_elastic.motor_speed_limit_rad_s does not");
  refused("slave.series_elastic.joint_counts_per_rev=1000000000", "slave.series_elastic.joint_counts_per_rev does not");
}

TEST(BadInput, EveryProgramRefusesARecordingThatCannotBeWritten) {
  ScratchDirectory scratch;
  const std::string nowhere = (scratch / "none/x.mcap").string();
  const auto with = [&](Arguments arguments) {
    arguments.insert(arguments.end(), {"--record", nowhere});
    return arguments;
  };
  const std::string says = "cannot write " + nowhere;
  expect_refused({Program::kMaster, with({"--scene", "demo", "--listen", "127.0.0.1:0"}), says});
  expect_refused({Program::kSlave, with({"--scene", "outage", "--peer", kNobody, "--quiet"}), says});
  expect_refused({Program::kMcu, with({"--scene", "demo", "--link", (scratch / "line").string()}), says});
  expect_refused({Program::kNetem, with({"--scene", "demo", "--listen", "127.0.0.1:0", "--forward", kNobody}), says});
  EXPECT_FALSE(std::filesystem::is_symlink(scratch / "line"));
}

TEST(BadInput, TheMasterRefusesWrongAddressesAndPorts) {
  const UdpSocket busy = UdpSocket::listen(parse_endpoint("127.0.0.1:0", EndpointUse::kListen));
  const std::string taken = to_string(busy.local_endpoint());
  const auto listen = [](const std::string& address) { return Arguments{"--scene", "demo", "--listen", address}; };
  expect_refused({Program::kMaster, {"--scene", "demo"}, "--listen is required"});
  expect_refused({Program::kMaster, listen(taken), taken + ": Address already in use"});
  expect_refused({Program::kMaster, listen("0.0.0.0:0"), "the link is not secured"});
  expect_refused({Program::kMaster, listen("127.0.0.1"), "the port is missing"});
  expect_refused({Program::kMaster, listen("127.0.0.1:99999"), "from 0 to 65535"});
  expect_refused({Program::kMaster, listen("somewhere:1"), "'somewhere:1'"});
  expect_refused({Program::kMaster, {"--scene", "demo", "--listen", "127.0.0.1:0", "--wait", "-1"}, "--wait"});
}

TEST(BadInput, TheSlaveRefusesWrongPeersAndPorts) {
  ScratchDirectory scratch;
  write_bytes(scratch / "file", "no port");
  const auto peer = [](const std::string& address) { return Arguments{"--scene", "outage", "--peer", address}; };
  expect_refused({Program::kSlave, {"--scene", "outage"}, "--peer is required"});
  expect_refused({Program::kSlave, peer("192.0.2.1:7000"), "the link is not secured"});
  expect_refused({Program::kSlave, peer("127.0.0.1:0"), "from 1 to 65535"});

  const auto serial = [](const std::string& path) {
    return Arguments{"--scene", "demo", "--peer", kNobody, "--serial", path};
  };
  const std::string none = (scratch / "none").string(), file = (scratch / "file").string();
  expect_refused({Program::kSlave, {"--scene", "demo", "--peer", kNobody}, "--serial PATH of its MCU is needed"});
  expect_refused({Program::kSlave,
                  {"--scene", "outage", "--peer", kNobody, "--serial", none},
                  "DIRECT_DRIVE slave: --serial has no use"});
  expect_refused({Program::kSlave, serial(none), "'" + none + "' cannot be found"});
  expect_refused({Program::kSlave, serial(file), "is not a serial port"});

  const auto stop = [](const std::string& path) {
    return Arguments{"--scene", "outage", "--peer", kNobody, "--stop-input", path};
  };
  expect_refused({Program::kSlave, stop(none), "stop cannot be read from '" + none + "': No such file"});
  expect_refused({Program::kSlave, stop("/dev/null"), "nobody holds its other end"});
  expect_refused({Program::kSlave, stop("fd:77"), "Bad file descriptor"});
}

TEST(BadInput, ASerialLineIsForOneStationOnly) {
  ScratchDirectory scratch;
  const std::string line = (scratch / "line").string();
  const Pty pty(line);
  const Arguments arguments{"--scene", "demo", "--peer", kNobody, "--serial", line};
  Arguments first{path_of(Program::kSlave), "--insecure", "--quiet", "--record", (scratch / "slave.mcap").string()};
  first.insert(first.end(), arguments.begin(), arguments.end());
  ChildProcess holder(first, slave_environment());
  ASSERT_TRUE(comes_true([&] { return std::filesystem::exists(scratch / "slave.mcap.part"); })) << holder.err();
  expect_refused({Program::kSlave, arguments, "another program holds it"});
  EXPECT_TRUE(holder.running());
}

TEST(BadInput, TheMcuLeavesForeignFilesAlone) {
  ScratchDirectory scratch;
  write_bytes(scratch / "file", "precious");
  const auto link = [](const std::string& path) { return Arguments{"--scene", "demo", "--link", path}; };
  expect_refused({Program::kMcu, {"--scene", "demo"}, "--link is required"});
  expect_refused({Program::kMcu, {"--scene", "outage", "--link", (scratch / "line").string()}, "no SERIES_ELASTIC"});
  expect_refused({Program::kMcu, link((scratch / "file").string()), "it is left alone"});
  expect_refused({Program::kMcu, link((scratch / "none/line").string()), "cannot place the link"});
  EXPECT_EQ(file_bytes(scratch / "file"), "precious");
}

// Root may read everything, so the test steps down where it can.
TEST(BadInput, NoPermissionIsSaid) {
  ScratchDirectory scratch;
  const std::string file = (scratch / "secret.txtpb").string();
  write_bytes(file, "duration_s: 1\n");
  std::filesystem::permissions(file, std::filesystem::perms::none);
  SomebodyElse nobody;
  const bool root = geteuid() == 0;
  if (root) {
    nobody = {{"/usr/bin/setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"}, scratch / "programs"};
    if (!std::filesystem::exists(nobody.step_down[0])) GTEST_SKIP() << "no setpriv to step down from root";
    using std::filesystem::perms;
    std::filesystem::create_directory(nobody.programs);
    for (const Program program : kPrograms) std::filesystem::copy(path_of(program), nobody.programs);
    for (const std::filesystem::path& place : {scratch.path(), nobody.programs})
      std::filesystem::permissions(place, perms::owner_all | perms::others_read | perms::others_exec);
  }
  for (const Program program : kPrograms) {
    Arguments arguments = rest_of(program, scratch);
    arguments.insert(arguments.end(), {"--scene", file});
    expect_refused({program, arguments, "Permission denied"}, root ? &nobody : nullptr);
  }
  const Arguments to_a_foreign_place{"--scene",     "demo",     "--listen",
                                     "127.0.0.1:0", "--record", (scratch / "x.mcap").string()};
  if (root) expect_refused({Program::kMaster, to_a_foreign_place, "Permission denied"}, &nobody);
}

TEST(Ending, NobodyCallsTheMaster) {
  ChildProcess master(
      {path_of(Program::kMaster), "--insecure", "--scene", "demo", "--listen", "127.0.0.1:0", "--wait", "0.2"});
  EXPECT_EQ(master.wait(), 1);
  EXPECT_NE(master.err().find("no patient's box called within 0.2 s"), std::string::npos) << master.err();
}

TEST(Ending, ALostPeerNeverEndsTheSlave) {
  ScratchDirectory scratch;
  const std::string file = (scratch / "slave.mcap").string();
  ChildProcess slave({path_of(Program::kSlave), "--insecure", "--scene", "outage", "--peer", kNobody, "--quiet",
                      "--record", file, "--set", "duration_s=1.5", "--set", "windows={}"});
  EXPECT_EQ(slave.wait(), 0) << slave.err();
  const Recorded recorded = read_recording(file);
  EXPECT_TRUE(recorded.problems.empty());
  ASSERT_FALSE(recorded.slave.empty());
  EXPECT_GE(recorded.slave.back().first - recorded.slave.front().first, 3 * kSecond / 2);
  for (const auto& [t, row] : recorded.slave) {
    const auto state = static_cast<StationState>(row.state);
    ASSERT_NE(asks_of(state), Asks::kMotion) << name_of(state);
    ASSERT_EQ(row.command_nm, 0);
  }
}

// Also before the peer was ever heard.
TEST(Ending, ASignalStopsEveryProgramWhileItWaits) {
  ScratchDirectory scratch;
  for (const int signal : {SIGINT, SIGTERM}) {
    for (const Program program : {Program::kMaster, Program::kNetem, Program::kMcu}) {
      Arguments command{path_of(program), "--scene", "demo"};
      const Arguments rest = rest_of(program, scratch);
      command.insert(command.end(), rest.begin(), rest.end());
      choose_link(program, command);
      ChildProcess child(command);
      EXPECT_NE(child.read_line(), "");
      child.send_signal(signal);
      EXPECT_EQ(child.wait(), 130) << role_of(program);
    }
  }
  EXPECT_FALSE(std::filesystem::is_symlink(scratch / "line"));
}

// Its buttons are signals, which end a program that does not listen to them yet.
TEST(Ending, TheMcuOutlivesThePatientsButtonsWhileItWaitsForItsHost) {
  ScratchDirectory scratch;
  ChildProcess mcu({path_of(Program::kMcu), "--scene", "demo", "--link", (scratch / "line").string()});
  EXPECT_NE(mcu.read_line(), "");
  for (const int signal : {SIGUSR1, SIGUSR2, SIGTERM}) mcu.send_signal(signal);
  EXPECT_EQ(mcu.wait(), 130) << mcu.err();
}

// In mid-session, both stations at once and twice, as a hurried hand at the keyboard does.
TEST(Ending, ASignalBringsBothStationsToRestWithCompleteRecordings) {
  for (const int signal : {SIGINT, SIGTERM}) {
    ScratchDirectory scratch;
    const auto file = [&](const char* role) { return (scratch / (std::string(role) + ".mcap")).string(); };
    ChildProcess master({path_of(Program::kMaster), "--insecure", "--scene", "zero_delay", "--listen", "127.0.0.1:0",
                         "--quiet", "--record", file("master")});
    const std::string line = master.read_line();
    ASSERT_TRUE(line.starts_with("listening ")) << master.err();
    ChildProcess slave({path_of(Program::kSlave), "--insecure", "--scene", "zero_delay", "--peer", line.substr(10),
                        "--quiet", "--record", file("slave")});
    const auto engaged = [&](const char* role, Recorded::Series<StationSample> Recorded::*rows) {
      try {
        const Recorded recorded = read_recording(file(role) + ".part");
        return !(recorded.*rows).empty() &&
               (recorded.*rows).back().second.state == static_cast<int>(StationState::kEngaged);
      } catch (const std::runtime_error&) {  // nothing flushed yet
        return false;
      }
    };
    ASSERT_TRUE(comes_true([&] {
      master.say("engage\n");
      return engaged("master", &Recorded::master) && engaged("slave", &Recorded::slave);
    }));
    for (int twice = 0; twice < 2; ++twice) {
      master.send_signal(signal);
      slave.send_signal(signal);
    }
    EXPECT_EQ(master.wait(), 130) << master.err();
    EXPECT_EQ(slave.wait(), 130) << slave.err();
    const Recorded m = read_recording(file("master")), s = read_recording(file("slave"));
    EXPECT_TRUE(m.problems.empty());
    EXPECT_TRUE(s.problems.empty());
    EXPECT_EQ(m.master.back().second.state, static_cast<int>(StationState::kStopped));
    EXPECT_EQ(s.slave.back().second.state, static_cast<int>(StationState::kStopped));
    EXPECT_EQ(m.master.back().second.command_nm, 0);
    EXPECT_EQ(s.slave.back().second.command_nm, 0);
  }
}

}  // namespace
}  // namespace farhand
