// Both stations as real programs over the secured link, and a stranger on the same machine who sends as fast as he is
// told: datagrams of any length to the station, beginnings of handshakes from many ports. What is asserted is function
// and what was counted; losses are compared between floods, because a busy machine loses packets by itself.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <random>
#include <thread>

#include "common/link/udp.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/secure/dtls.hpp"
#include "common/secure/pairing_key.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

// `per_second` datagrams of `bytes` zeros to a socket, evenly, until told to stop.
class Stranger {
 public:
  Stranger(const UdpEndpoint& to, int per_second, std::size_t bytes)
      : socket_(UdpSocket::dial(to)), datagram_(bytes), thread_([this, per_second] { run(per_second); }) {}
  ~Stranger() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t sent() const { return socket_.counters().sent; }  // after stop()

 private:
  void run(int per_second) {
    const Nanoseconds begun = monotonic_now();
    for (std::int64_t sent = 0; !stop_;) {
      const std::int64_t due = (monotonic_now() - begun) / (kSecond / 1000) * per_second / 1000;
      // A stall of this machine is not made up for by a burst of more than 20 ms.
      if (due - sent > per_second / 50) sent = due - per_second / 50;
      for (; sent < due && !stop_; ++sent) socket_.send(datagram_);
      usleep(200);
    }
  }

  UdpSocket socket_;
  std::vector<std::byte> datagram_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

struct Ended {
  std::uint64_t sessions = 0, flood = 0;
  record::Counters master;
  double loss() const {  // of the packets since the first that came
    return static_cast<double>(master.lost()) / static_cast<double>(master.lost() + master.received());
  }
};

std::uint64_t number_before(const std::string& text, const std::string& what) {
  const std::size_t end = text.find(" " + what);
  const std::size_t begin = end == std::string::npos ? end : text.find_last_not_of("0123456789", end - 1) + 1;
  return end == std::string::npos || begin == end ? 0 : std::stoull(text.substr(begin, end - begin));
}

// A master that listens, and a slave once it is asked for.
struct Stations {
  explicit Stations(const std::vector<std::string>& more) : sets(more) {
    store_key(key, PairingKey::random(), ExistingKey::kRefuse);
    master = start(Program::kMaster, "--listen", "127.0.0.1:0");
    first_line = master->read_line();
    if (!first_line.starts_with("listening ")) throw std::runtime_error(master->err());
    address = first_line.substr(10);
  }
  void start_slave() { slave = start(Program::kSlave, "--peer", address); }
  // Its live line shows a round trip. Whether it is still engaged is for the machine to say.
  bool hears() {
    return comes_true([&] {
      const std::string said = master->err();
      const std::size_t at = said.rfind("RTT ");
      return at != std::string::npos && at + 4 < said.size() && said[at + 4] != '-';
    });
  }
  void stop() {
    for (ChildProcess* program : {slave.get(), master.get()}) {
      program->send_signal(SIGTERM);
      EXPECT_EQ(program->wait(), 130) << program->err();
    }
  }
  // What the master has counted, and said of it at its end.
  record::Counters counters() const { return read_recording(scratch / "master.mcap").info.counters(0); }
  std::string said() const { return master->out().substr(first_line.size() + 1); }

  std::unique_ptr<ChildProcess> start(Program program, const std::string& option, const std::string& at) const {
    const std::string file = (scratch / (std::string(role_of(program)) + ".mcap")).string();
    std::vector<std::string> command{path_of(program), "--scene", "zero_delay", "--key", key.string()};
    command.insert(command.end(), {option, at, "--record", file, "--set", "duration_s=300", "--set", "windows={}"});
    command.insert(command.end(), {"--set", "slave.shaking_limit_rad_s=100"});
    for (const std::string& set : sets) command.insert(command.end(), {"--set", set});
    return std::make_unique<ChildProcess>(command);
  }

  ScratchDirectory scratch;
  std::filesystem::path key = scratch / "key";
  std::vector<std::string> sets;
  std::unique_ptr<ChildProcess> master, slave;
  std::string first_line, address;
};

// A session under a flood on the station for `flood_s`.
Ended session_under(int per_second, std::size_t bytes, double flood_s, const std::vector<std::string>& sets = {}) {
  Stations stations(sets);
  stations.start_slave();
  EXPECT_TRUE(stations.hears()) << stations.master->err();
  Ended ended;
  {
    Stranger stranger(parse_endpoint(stations.address, EndpointUse::kPeer), per_second, bytes);
    usleep(static_cast<useconds_t>(1e6 * flood_s));
    stranger.stop();
    ended.flood = stranger.sent();
  }
  usleep(2'500'000);  // one more live line
  stations.stop();
  ended.sessions = number_before(stations.master->out(), "sessions");
  const record::Counters& c = ended.master = stations.counters();
  const std::uint64_t counted =
      c.dropped_too_long() + c.dropped_by_kernel() + c.rejected_foreign() + c.dropped_handshake();
  EXPECT_GE(counted, ended.flood) << "each datagram of the flood is in a counter of the recording";
  EXPECT_NE(stations.master->err().find("  dropped "), std::string::npos)
      << "the live line shows it: " << stations.master->err();
  std::printf("%6zu bytes, %6.0f a second: %.2f %% of %llu packets lost, counted %llu of %llu\n%s", bytes,
              static_cast<double>(ended.flood) / flood_s, 100 * ended.loss(),
              static_cast<unsigned long long>(c.lost() + c.received()), static_cast<unsigned long long>(counted),
              static_cast<unsigned long long>(ended.flood), stations.said().c_str());
  return ended;
}

TEST(FloodedProcesses, LongDatagramsEndNeitherTheTickNorTheSessionAndAreCounted) {
  const Ended ended = session_under(20'000, 600, 1);
  EXPECT_EQ(ended.sessions, 1u);
  EXPECT_GT(ended.master.dropped_by_kernel() + ended.master.dropped_too_long(), 5000u);
  EXPECT_LT(ended.loss(), 0.5);
}

// A hundred thousand a second for ten seconds, each length against small ones.
TEST(NightlyFloodedProcesses, LongDatagramsCostNoMoreThanSmallOnes) {
  const std::vector<std::string> priority{"runtime.priority=80"};
  const Ended small = session_under(100'000, 100, 10, priority);
  for (const std::size_t bytes : {600u, 1400u, 9000u}) {
    const Ended ended = session_under(100'000, bytes, 10, priority);
    EXPECT_EQ(ended.sessions, 1u);
    EXPECT_LE(ended.loss(), small.loss() + 0.01);
  }
}

// Callers with sockets of their own that have fetched their cookies without the key, and begin anew again and again.
TEST(NightlyFloodedProcesses, HellosOfManyPortsDoNotKeepTheRightBoxOut) {
  for (const auto& [ports, per_second] : {std::pair{8, 11}, std::pair{64, 1000}}) {
    Stations stations({});
    const UdpEndpoint station = parse_endpoint(stations.address, EndpointUse::kPeer);
    DtlsContext context(LinkEnd::kDialer, PairingKey::random());
    struct Caller {
      UdpSocket socket;
      Bytes hello;
    };
    std::vector<Caller> callers;
    for (int i = 0; i < ports; ++i) {
      Dtls dtls(context);
      dtls.step();
      Caller caller{UdpSocket::dial(station), dtls.take_written().at(0)};
      std::array<std::byte, 512> cookie;
      ASSERT_TRUE(comes_true([&] {
        caller.socket.send(caller.hello);
        usleep(2000);
        const auto answer = caller.socket.receive(cookie);
        if (!answer || answer->dropped) return false;
        dtls.step(std::span(cookie).first(answer->size));
        return true;
      }));
      caller.hello = dtls.take_written().at(0);
      callers.push_back(std::move(caller));
    }
    std::atomic<bool> stop{false};
    std::uint64_t sent = 0;
    std::thread calling([&, rate = per_second] {
      std::mt19937_64 bits(1);
      for (; !stop; ++sent) {
        Caller& caller = callers[sent % callers.size()];
        for (std::size_t i = 27; i < 59; ++i) caller.hello[i] = static_cast<std::byte>(bits());  // its random bytes
        caller.socket.send(caller.hello);
        usleep(static_cast<useconds_t>(1'000'000 / rate));
      }
    });
    usleep(3'000'000);
    const Nanoseconds begun = monotonic_now();
    stations.start_slave();
    EXPECT_TRUE(stations.hears()) << stations.master->err();
    const double took_s = to_seconds(monotonic_now() - begun);
    stop = true;
    calling.join();
    stations.stop();
    std::printf("%d ports, %d hellos a second: heard after %.1f s, %llu hellos\n%s", ports, per_second, took_s,
                static_cast<unsigned long long>(sent), stations.said().c_str());
    EXPECT_EQ(number_before(stations.master->out(), "sessions"), 1u);
    EXPECT_LT(took_s, 10 + 10);  // and as long again for the machine, and for the line that says so
  }
}

}  // namespace
}  // namespace farhand
