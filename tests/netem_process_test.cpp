// farhand-netem as a process between two real sockets: what it must carry, hold back, lose, count, refuse, and how it
// ends.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "common/link/udp.hpp"
#include "common/runtime/run_loop.hpp"
#include "netem/shim.hpp"
#include "tests/support/child_process.hpp"

namespace farhand {
namespace {

UdpSocket listener() { return UdpSocket::listen(parse_endpoint("127.0.0.1:0", EndpointUse::kListen)); }

class Netem {
 public:
  explicit Netem(const UdpEndpoint& master, const std::vector<std::string>& more = {}) : child_(command(master, more)) {
    const std::string line = child_.read_line();
    EXPECT_EQ(line.rfind("listening 127.0.0.1:", 0), 0u) << line << child_.err();
    if (line.size() > 10) address_ = parse_endpoint(line.substr(10), EndpointUse::kPeer);
  }
  const UdpEndpoint& address() const { return address_; }
  ChildProcess& process() { return child_; }

 private:
  static std::vector<std::string> command(const UdpEndpoint& master, const std::vector<std::string>& more) {
    std::vector<std::string> all{FARHAND_NETEM,     "--listen", "127.0.0.1:0", "--forward",
                                 to_string(master), "--scene",  "zero_delay"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ChildProcess child_;
  UdpEndpoint address_;
};

struct Numbered {
  std::uint64_t number = 0;
  Nanoseconds sent = 0;
  std::uint8_t filler[84] = {};
};

void send_numbered(UdpSocket& socket, std::uint64_t number) {
  Numbered packet{number, monotonic_now(), {}};
  std::memset(packet.filler, static_cast<int>(number % 251), sizeof packet.filler);
  socket.send(std::as_bytes(std::span(&packet, 1)));
}

struct Arrived {
  Numbered packet;
  Nanoseconds delay = 0;
  UdpEndpoint sender;
};

// Everything that comes until `count` are there or nothing came for a while; the pause is generous, it only costs time
// when packets lack.
std::vector<Arrived> gather(UdpSocket& socket, std::size_t count, int quiet_ms = 2000) {
  std::vector<Arrived> all;
  std::byte buffer[256];
  while (all.size() < count) {
    if (const auto got = socket.receive(buffer)) {
      Arrived arrived;
      EXPECT_EQ(got->size, sizeof(Numbered));
      std::memcpy(&arrived.packet, buffer, sizeof(Numbered));
      EXPECT_EQ(arrived.packet.filler[83], arrived.packet.number % 251);
      arrived.delay = monotonic_now() - arrived.packet.sent;
      arrived.sender = got->sender;
      all.push_back(arrived);
      continue;
    }
    pollfd wait{socket.native_handle(), POLLIN, 0};
    if (poll(&wait, 1, quiet_ms) <= 0) break;
  }
  return all;
}

TEST(NetemProcess, CarriesBothWaysAndHoldsEachPacketAtLeastItsDelay) {
  UdpSocket master = listener();
  Netem netem(master.local_endpoint(),
              {"--set", "network.forward={delay_s: 0.03}", "--set", "network.backward={delay_s: 0.05}"});
  UdpSocket slave = UdpSocket::dial(netem.address());
  for (std::uint64_t i = 0; i < 50; ++i) send_numbered(slave, i);
  const auto at_master = gather(master, 50);
  ASSERT_EQ(at_master.size(), 50u);
  master.accept(at_master[0].sender);
  for (std::uint64_t i = 0; i < 50; ++i) send_numbered(master, i);
  const auto at_slave = gather(slave, 50);
  ASSERT_EQ(at_slave.size(), 50u);
  for (std::uint64_t i = 0; i < 50; ++i) {
    EXPECT_EQ(at_master[i].packet.number, i) << "without jitter nothing overtakes";
    EXPECT_EQ(at_slave[i].packet.number, i);
    EXPECT_GE(at_master[i].delay, 50 * kMillisecond);
    EXPECT_GE(at_slave[i].delay, 30 * kMillisecond);
  }
  netem.process().send_signal(SIGTERM);
  EXPECT_EQ(netem.process().wait(), 130);
  const std::string& out = netem.process().out();
  EXPECT_NE(out.find("forward (master to slave): scene says 30 ms"), std::string::npos) << out;
  EXPECT_NE(out.find("achieved         50     0.00"), std::string::npos) << out;
  std::printf("%s", out.c_str());
}

TEST(NetemProcess, JitterReordersAndLossLosesAsTheTableSays) {
  UdpSocket master = listener();
  Netem netem(master.local_endpoint(),
              {"--set", "network.backward={delay_s: 0.02 jitter_s: 0.02 loss: 0.3}", "--seed", "5"});
  UdpSocket slave = UdpSocket::dial(netem.address());
  // Taken a hundred at a time: the socket's buffer holds 277 such datagrams, and a slow machine sends all before it
  // reads.
  std::vector<Arrived> got;
  for (std::uint64_t i = 0; i < 400; ++i) {
    send_numbered(slave, i);
    usleep(200);
    if (i % 100 != 99) continue;
    const auto more = gather(master, 100, i == 399 ? 500 : 60);
    got.insert(got.end(), more.begin(), more.end());
  }
  bool reordered = false;
  for (std::size_t i = 1; i < got.size(); ++i) reordered |= got[i].packet.number < got[i - 1].packet.number;
  EXPECT_TRUE(reordered);
  EXPECT_NEAR(static_cast<double>(got.size()), 280, 55);  // 6 standard deviations of the binomial (400, 0.7)
  netem.process().send_signal(SIGINT);
  netem.process().send_signal(SIGINT);
  EXPECT_EQ(netem.process().wait(), 130);
  char row[64];
  std::snprintf(row, sizeof row, "achieved        400 %8.2f", 100.0 * static_cast<double>(400 - got.size()) / 400);
  EXPECT_NE(netem.process().out().find(row), std::string::npos) << row << "\n" << netem.process().out();
}

TEST(NetemProcess, ACutLosesEverythingFromItsTimeOnCountedFromTheFirstPacket) {
  UdpSocket master = listener();
  Netem netem(master.local_endpoint(), {"--set", "network.backward={cut_from_s: 0.2 cut_until_s: 1e6}"});
  usleep(400'000);  // silence before the first packet does not count
  UdpSocket slave = UdpSocket::dial(netem.address());
  send_numbered(slave, 1);
  EXPECT_EQ(gather(master, 1).size(), 1u);
  usleep(300'000);
  send_numbered(slave, 2);
  EXPECT_EQ(gather(master, 1, 300).size(), 0u);
}

TEST(NetemProcess, AnswersGoToTheNewestClientAndAMasterMayComeLate) {
  UdpEndpoint place;
  {
    UdpSocket socket = listener();
    place = socket.local_endpoint();
  }
  Netem netem(place);
  UdpSocket first = UdpSocket::dial(netem.address());
  for (std::uint64_t i = 0; i < 10; ++i) send_numbered(first, i);  // nobody listens there yet
  usleep(50'000);
  UdpSocket master = UdpSocket::listen(place);
  UdpSocket second = UdpSocket::dial(netem.address());
  // The first sends after a refusal may still report it.
  std::vector<Arrived> got;
  for (std::uint64_t i = 20; i < 120 && got.empty(); ++i) {
    send_numbered(second, i);
    got = gather(master, 1, 20);
  }
  ASSERT_EQ(got.size(), 1u);
  master.accept(got[0].sender);
  send_numbered(master, 77);
  const auto answer = gather(second, 1);
  ASSERT_EQ(answer.size(), 1u);
  EXPECT_EQ(answer[0].packet.number, 77u);
  EXPECT_EQ(gather(first, 1, 50).size(), 0u);
}

TEST(NetemProcess, EndsByItselfAfterItsDuration) {
  Netem netem(parse_endpoint("127.0.0.1:9", EndpointUse::kPeer), {"--duration", "0.1"});
  EXPECT_EQ(netem.process().wait(), 0);
  EXPECT_NE(netem.process().out().find("backward (slave to master)"), std::string::npos);
}

TEST(NetemProcess, EveryWrongArgumentIsOneSentenceAndExit2) {
  UdpSocket busy = listener();
  const std::string busy_address = to_string(busy.local_endpoint());
  const std::string good = "127.0.0.1:0";
  struct Case {
    std::vector<std::string> arguments;
    std::string says;
  };
  const std::vector<Case> cases{
      {{}, "--listen is required"},
      {{"--listen", good, "--forward", "127.0.0.1:9"}, "--scene is required"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "no_such_scene"}, "no_such_scene"},
      {{"--listen", busy_address, "--forward", "127.0.0.1:9", "--scene", "zero_delay"},
       busy_address + ": Address already in use"},
      {{"--listen", "127.0.0.1", "--forward", "127.0.0.1:9", "--scene", "zero_delay"}, "port is missing"},
      {{"--listen", good, "--forward", "127.0.0.1:0", "--scene", "zero_delay"}, "from 1 to 65535"},
      {{"--listen", "0.0.0.0:0", "--forward", "127.0.0.1:9", "--scene", "zero_delay"}, "not secured"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "zero_delay", "--set", "network.forward.loss=2"},
       "network.forward.loss"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "zero_delay", "--duration", "nan"}, "--duration"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "zero_delay", "--duration", "-1"}, "--duration"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "zero_delay", "--fast"}, "--fast"},
      {{"--listen", good, "--forward", "127.0.0.1:9", "--scene", "zero_delay", "--seed", "-1"},
       "--seed: -1 is not allowed; give a whole number from 0"},
      {{"--listen", "127.0.0.1:9", "--forward", "127.0.0.1:9", "--scene", "zero_delay"}, "is the address of --listen"},
  };
  for (const Case& one : cases) {
    std::vector<std::string> command{FARHAND_NETEM};
    command.insert(command.end(), one.arguments.begin(), one.arguments.end());
    ChildProcess child(command);
    EXPECT_EQ(child.wait(), 2) << one.says;
    EXPECT_NE(child.err().find(one.says), std::string::npos) << child.err();
    EXPECT_EQ(child.out(), "");
  }
}

TEST(Shim, TellsOfEveryPacketWhetherItLeftOrWasLost) {
  UdpSocket master = listener();
  LinkModelParams lossy;
  lossy.delay_s = 0.005;
  lossy.loss = 0.5;
  Shim shim(parse_endpoint("127.0.0.1:0", EndpointUse::kListen), master.local_endpoint(), {}, lossy, 3);
  UdpSocket slave = UdpSocket::dial(shim.local_endpoint());
  for (std::uint64_t i = 0; i < 100; ++i) send_numbered(slave, i);
  std::vector<LinkSample> samples;
  const StopSignals stop;
  shim.run(kSecond / 2, stop, [&](Nanoseconds, const LinkSample& sample) { samples.push_back(sample); });
  ASSERT_EQ(samples.size(), 100u);
  std::uint64_t lost = 0;
  for (const LinkSample& sample : samples) {
    EXPECT_FALSE(sample.forward);
    EXPECT_GE(sample.t_s, 0);
    EXPECT_DOUBLE_EQ(sample.asked_delay_s, 0.005);
    lost += sample.lost ? 1 : 0;
    EXPECT_TRUE(sample.lost || sample.achieved_delay_s >= sample.asked_delay_s);
  }
  EXPECT_EQ(shim.backward().lost, lost);
  EXPECT_EQ(shim.backward().entered, 100u);
  EXPECT_EQ(shim.backward().achieved.count(), 100 - lost);
  EXPECT_EQ(gather(master, 200, 50).size(), 100 - lost);
}

TEST(DelayStatistics, AgreesWithTheClosedFormOfARamp) {
  DelayStatistics ramp;
  for (int i = 0; i <= 1000; ++i) ramp.add(i * kMillisecond / 10);
  EXPECT_NEAR(ramp.mean_s(), 0.05, 1e-12);
  EXPECT_NEAR(ramp.deviation_s(), 0.1 / 1000 * std::sqrt(1001.0 * 1002 / 12), 1e-12);
  EXPECT_NEAR(ramp.quantile_s(0.5), 0.05, 0.05 / 128 + 1e-4);
  EXPECT_EQ(ramp.min_s(), 0);
  EXPECT_EQ(ramp.max_s(), 0.1);
}

}  // namespace
}  // namespace farhand
