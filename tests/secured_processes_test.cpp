// Both stations as real programs over the secured link, and someone on the path between them who captures, repeats,
// forges and changes the address. Pairing as its user sees it.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <random>
#include <thread>

#include "common/link/codec.hpp"
#include "common/link/udp.hpp"
#include "common/secure/pairing_key.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

using Arguments = std::vector<std::string>;
using Datagram = std::vector<std::byte>;

// Stands between the slave and the master and passes on what each says.
class Path {
 public:
  explicit Path(const UdpEndpoint& master)
      : master_(master), to_slave_(UdpSocket::listen(any())), to_master_(UdpSocket::dial(master)) {
    thread_ = std::thread([this] { run(); });
  }
  ~Path() {
    stop_ = true;
    thread_.join();
  }

  std::string address() const { return to_string(to_slave_.local_endpoint()); }
  // From now on the master sees the slave behind another port, as after a NAT forgot it.
  void rebind() { rebind_ = true; }
  // Every datagram comes damaged before, from a foreign port besides, and twice.
  std::atomic<bool> attack{false};
  // With every packet to the master come ten datagrams from elsewhere: beginnings of handshakes, packets of others,
  // noise.
  std::atomic<bool> flood{false};

  std::uint64_t packets_to_master() const { return packets_to_master_; }
  std::vector<Datagram> captured() {
    const std::lock_guard lock(mutex_);
    return captured_;
  }

 private:
  static UdpEndpoint any() { return parse_endpoint("127.0.0.1:0", EndpointUse::kListen); }

  void run() {
    UdpSocket foreign = UdpSocket::dial(master_);
    std::array<std::byte, 2048> buffer;
    while (!stop_) {
      if (rebind_.exchange(false)) to_master_ = UdpSocket::dial(master_);
      pollfd ready[]{{to_slave_.native_handle(), POLLIN, 0}, {to_master_.native_handle(), POLLIN, 0}};
      ::poll(ready, 2, 10);
      for (const bool up : {true, false}) {
        UdpSocket& from = up ? to_slave_ : to_master_;
        UdpSocket& to = up ? to_master_ : to_slave_;
        while (const auto received = from.receive(buffer)) {
          if (received->dropped) continue;
          if (up) to_slave_.accept(received->sender);
          pass(std::span(buffer).first(received->size), to, up ? &foreign : nullptr);
        }
      }
    }
  }

  void pass(std::span<const std::byte> datagram, UdpSocket& to, UdpSocket* foreign) {
    const bool packet = datagram[0] >= std::byte{128};
    if (packet && foreign != nullptr) ++packets_to_master_;
    {
      const std::lock_guard lock(mutex_);
      if (captured_.size() < 20'000) captured_.emplace_back(datagram.begin(), datagram.end());
    }
    for (int i = 0; flood && foreign != nullptr && packet && i < 10; ++i) {
      Datagram junk(datagram.begin(), datagram.end());
      for (std::size_t at = i % 3 == 0 ? 0 : 12; at < junk.size(); ++at) junk[at] = static_cast<std::byte>(bits_());
      foreign->send(i % 3 == 1 ? std::span<const std::byte>(hello_) : junk);
    }
    if (hello_.empty() && !packet) hello_.assign(datagram.begin(), datagram.end());
    if (attack) {
      Datagram damaged(datagram.begin(), datagram.end());
      damaged[bits_() % damaged.size()] ^= static_cast<std::byte>(1u << bits_() % 8);
      to.send(damaged);
      if (foreign != nullptr) foreign->send(datagram);
      to.send(datagram);
    }
    to.send(datagram);
  }

  UdpEndpoint master_;
  UdpSocket to_slave_, to_master_;
  std::atomic<bool> stop_{false}, rebind_{false};
  std::atomic<std::uint64_t> packets_to_master_{0};
  std::mutex mutex_;
  std::vector<Datagram> captured_;
  Datagram hello_;  // the first word of the handshake
  std::mt19937_64 bits_{1};
  std::thread thread_;
};

class Secured : public testing::Test {
 protected:
  Secured() {
    store_key(key_, PairingKey::random(), ExistingKey::kRefuse);
    start_master("127.0.0.1:0");
    path_ = std::make_unique<Path>(parse_endpoint(master_address_, EndpointUse::kPeer));
    start_slave();
  }

  Arguments station(Program program, const std::string& file) const {
    return {path_of(program), "--scene", "zero_delay", "--key", key_.string(), "--quiet", "--record",
            (scratch_ / file).string(), "--set", "duration_s=300", "--set", "windows={}",
            // The loop of a direct drive is closed here, and shakes where one tick in five is in time.
            "--set", "slave.shaking_limit_rad_s=100"};
  }

  void start_master(const std::string& listen) {
    Arguments command = station(Program::kMaster, master_file_ = "master" + std::to_string(++starts_) + ".mcap");
    command.insert(command.end(), {"--listen", listen});
    master_ = std::make_unique<ChildProcess>(command);
    const std::string line = master_->read_line();
    ASSERT_TRUE(line.starts_with("listening ")) << master_->err();
    master_address_ = line.substr(10);
  }

  void start_slave() {
    Arguments command = station(Program::kSlave, slave_file_ = "slave" + std::to_string(++starts_) + ".mcap");
    command.insert(command.end(), {"--peer", path_->address()});
    slave_ = std::make_unique<ChildProcess>(command);
  }

  // The newest rows of the newest recordings say that either side hears the other.
  bool both_hear() {
    return comes_true([&] {
      const auto hears = [&](const std::string& file, Recorded::Series<StationSample> Recorded::*rows) {
        try {
          const Recorded recorded = read_recording(scratch_ / (file + ".part"));
          if ((recorded.*rows).empty()) return false;
          const auto& [t, row] = (recorded.*rows).back();
          return row.newest_peer_arrival_ns > 0 && t - row.newest_peer_arrival_ns < kSecond;
        } catch (const std::runtime_error&) {  // nothing flushed yet
          return false;
        }
      };
      return hears(master_file_, &Recorded::master) && hears(slave_file_, &Recorded::slave);
    });
  }

  // The number before `what` in what the station said at its end.
  static std::uint64_t counted(const ChildProcess& station, const std::string& what) {
    const std::string out = station.out();
    const std::size_t end = out.find(" " + what);
    const std::size_t begin = out.find_last_not_of("0123456789", end - 1) + 1;
    return end == std::string::npos || begin == end ? 0 : std::stoull(out.substr(begin, end - begin));
  }

  void stop() {
    for (ChildProcess* station : {master_.get(), slave_.get()}) {
      station->send_signal(SIGTERM);
      EXPECT_EQ(station->wait(), 130) << station->err();
    }
  }

  ScratchDirectory scratch_;
  std::filesystem::path key_ = scratch_ / "key";
  int starts_ = 0;
  std::string master_file_, slave_file_, master_address_;
  std::unique_ptr<ChildProcess> master_, slave_;
  std::unique_ptr<Path> path_;
};

TEST_F(Secured, ACaptureShowsNoField) {
  ASSERT_TRUE(both_hear()) << master_->err() << slave_->err();
  stop();
  PacketCodec<1> codec;
  Packet<1> packet;
  const auto plain = codec.encode(packet);
  const Datagram version(plain.begin(), plain.begin() + 6);  // its field, and the tag of the next
  std::size_t sealed = 0;
  for (const Datagram& datagram : path_->captured()) {
    if (datagram[0] >= std::byte{128}) ++sealed;
    EXPECT_EQ(std::search(datagram.begin(), datagram.end(), version.begin(), version.end()), datagram.end());
    for (std::size_t at = 0; at < datagram.size(); ++at) {
      ASSERT_NE(codec.decode(std::span(datagram).subspan(at), packet), DecodeResult::kOk);
    }
  }
  std::printf("%zu packets captured\n", sealed);
  EXPECT_GT(sealed, 100u);
}

TEST_F(Secured, RepetitionsForgeriesAndForeignSendersHaveNoEffect) {
  ASSERT_TRUE(both_hear()) << master_->err() << slave_->err();
  path_->attack = true;
  ASSERT_TRUE(comes_true([&] { return path_->packets_to_master() > 1500; }));
  EXPECT_TRUE(both_hear());
  stop();
  std::printf("%s", master_->out().c_str());
  EXPECT_LE(counted(*master_, "opened"), path_->packets_to_master()) << "each authentic one once";
  EXPECT_GT(counted(*master_, "forged") + counted(*master_, "malformed"), 300u);
  EXPECT_GT(counted(*master_, "replayed"), 300u);
  EXPECT_GT(counted(*master_, "of another address"), 300u);
  EXPECT_EQ(counted(*master_, "sessions"), 1u);
  EXPECT_GT(counted(*slave_, "replayed"), 300u);
}

TEST_F(Secured, AFloodOfTenForeignDatagramsForEachPacketTakesNothingFromTheSession) {
  ASSERT_TRUE(both_hear()) << master_->err() << slave_->err();
  path_->flood = true;
  const std::uint64_t begun = path_->packets_to_master();
  ASSERT_TRUE(comes_true([&] { return path_->packets_to_master() > begun + 2000; }));
  EXPECT_TRUE(both_hear());
  stop();
  std::printf("%s", master_->out().c_str());
  EXPECT_EQ(counted(*master_, "sessions"), 1u);
  EXPECT_GT(counted(*master_, "of another address"), 5000u);
  // While the machine stalls the flood fills the socket, and packets are lost as on a network.
  EXPECT_GT(counted(*master_, "opened"), 1000u);
}

TEST_F(Secured, ARestartedBoxAndOneBehindANewAddressAreHeardAgain) {
  ASSERT_TRUE(both_hear()) << master_->err() << slave_->err();
  slave_->send_signal(SIGKILL);
  slave_->wait();
  start_slave();
  EXPECT_TRUE(both_hear()) << "restarted box: " << master_->err() << slave_->err();
  path_->rebind();
  usleep(1'500'000);  // until neither can think that it still hears
  EXPECT_TRUE(both_hear()) << "new address: " << master_->err() << slave_->err();
  stop();
}

using NightlySecured = Secured;
TEST_F(NightlySecured, ARestartedMasterIsHeardAgain) {
  ASSERT_TRUE(both_hear()) << master_->err() << slave_->err();
  master_->send_signal(SIGKILL);
  master_->wait();
  start_master(master_address_);
  EXPECT_TRUE(both_hear()) << master_->err() << slave_->err();
  stop();
}

class Pairing : public testing::Test {
 protected:
  struct Said {
    int code;
    std::string out, err;
  };
  Said pair(Program program, const std::string& file, const Arguments& more = {}) {
    Arguments command{path_of(program), "pair", "--key", (scratch_ / file).string()};
    command.insert(command.end(), more.begin(), more.end());
    ChildProcess child(command);
    child.end_input();
    const int code = child.wait();
    return {code, child.out(), child.err()};
  }
  static std::string phrase(const Said& said) {
    constexpr std::string_view kBefore = "check phrase: ";
    const std::size_t at = said.out.find(kBefore);
    return at == std::string::npos ? "none" : said.out.substr(at + kBefore.size(), 4 * 5 + 3);
  }

  // What a station with this key says, and its exit code, when its peer has another or other settings.
  Said dial(const std::string& key, const std::string& master_key, const Arguments& sets) {
    ChildProcess master({path_of(Program::kMaster), "--scene", "zero_delay", "--key", (scratch_ / master_key).string(),
                         "--quiet", "--listen", "127.0.0.1:0"});
    Arguments command{path_of(Program::kSlave),
                      "--scene",
                      "zero_delay",
                      "--key",
                      (scratch_ / key).string(),
                      "--quiet",
                      "--set",
                      "windows={}",
                      "--set",
                      "duration_s=3",
                      "--peer",
                      master.read_line().substr(10)};
    for (const std::string& set : sets) command.insert(command.end(), {"--set", set});
    ChildProcess slave(command);
    const int code = slave.wait();
    master.send_signal(SIGTERM);
    master_code_ = master.wait();
    master_err_ = master.err();
    return {code, slave.out(), slave.err()};
  }

  ScratchDirectory scratch_;
  int master_code_ = 0;
  std::string master_err_;
};

TEST_F(Pairing, MakesImportsRotatesAndRevokesAKey) {
  const Said made = pair(Program::kSlave, "box");
  EXPECT_EQ(made.code, 0) << made.err;
  const std::string first = phrase(made);
  EXPECT_NE(first, "none");
  EXPECT_EQ(phrase(pair(Program::kSlave, "box")), first) << "it is shown again, not made again";
  EXPECT_EQ(phrase(pair(Program::kMaster, "station", {"--import", (scratch_ / "box").string()})), first);
  EXPECT_EQ(load_key(scratch_ / "box"), load_key(scratch_ / "station"));

  const std::string second = phrase(pair(Program::kSlave, "box", {"--rotate"}));
  EXPECT_NE(second, first);
  EXPECT_EQ(phrase(pair(Program::kMaster, "station")), first) << "until it is imported";
  EXPECT_EQ(phrase(pair(Program::kMaster, "station", {"--import", (scratch_ / "box").string()})), second);

  EXPECT_EQ(pair(Program::kMaster, "station", {"--revoke"}).code, 0);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "station"));
  EXPECT_EQ(pair(Program::kMaster, "station", {"--revoke"}).code, 2);
  EXPECT_EQ(pair(Program::kMaster, "station", {"--rotate"}).code, 2) << "there is none to change";
  EXPECT_EQ(pair(Program::kMaster, "other", {"--rotate", "--revoke"}).code, 2);
  write_bytes(scratch_ / "text", "no key");
  const Said refused = pair(Program::kMaster, "other", {"--import", (scratch_ / "text").string()});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("64 hexadecimal digits"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "other"));
}

TEST_F(Pairing, AStationRefusesToStartWithoutAPrivateKey) {
  pair(Program::kSlave, "open");
  std::filesystem::permissions(scratch_ / "open", std::filesystem::perms::group_read,
                               std::filesystem::perm_options::add);
  for (const auto& [file, says] : {std::pair{"none", "does not exist; make a key with 'farhand-slave pair'"},
                                   std::pair{"open", "has mode 0640"}}) {
    for (const Arguments& command : {Arguments{path_of(Program::kMaster), "--listen", "127.0.0.1:0"},
                                     Arguments{path_of(Program::kSlave), "--peer", "127.0.0.1:9"}}) {
      Arguments all = command;
      all.insert(all.end(), {"--scene", "zero_delay", "--key", (scratch_ / file).string()});
      ChildProcess child(all);
      EXPECT_EQ(child.wait(), 2);
      EXPECT_NE(child.err().find(says), std::string::npos) << child.err();
      EXPECT_EQ(child.out(), "");
    }
  }
  ChildProcess both({path_of(Program::kMaster), "--listen", "127.0.0.1:0", "--scene", "zero_delay", "--insecure",
                     "--key", (scratch_ / "open").string()});
  EXPECT_EQ(both.wait(), 2);
}

TEST_F(Pairing, TheWrongKeyAndOtherSettingsAreRefusedByASentence) {
  pair(Program::kSlave, "box");
  pair(Program::kMaster, "other");
  const Said wrong_key = dial("box", "other", {});
  EXPECT_EQ(wrong_key.code, 1);
  EXPECT_NE(wrong_key.err.find("unknown psk identity"), std::string::npos) << wrong_key.err;
  EXPECT_EQ(master_code_, 130) << "it waits for the right one";

  const Said other_gain = dial("box", "box", {"control.K_p_per_s2=300"});
  EXPECT_EQ(other_gain.code, 2);
  EXPECT_NE(other_gain.err.find("refused, configuration: "), std::string::npos) << other_gain.err;
  EXPECT_EQ(master_code_, 2);
  EXPECT_NE(master_err_.find("refused, configuration: "), std::string::npos) << master_err_;
}

TEST(SecuredProcesses, LoopThreadsTouchNeitherHeapNorMutexThroughTheNetwork) {
  if (kCounterIsBlind) GTEST_SKIP() << "nothing can be counted below a sanitizer";
  ScratchDirectory scratch;
  store_key(scratch / "key", PairingKey::random(), ExistingKey::kRefuse);
  const std::string counts = (scratch / "counts").string();
  SessionProcesses session(scratch.path(), {.scene = "demo",
                                            .sets = {"duration_s=2", "windows={}"},
                                            .preloads = {(program_directory() / "libfarhand_count.so").string()},
                                            .station_environment = {"FARHAND_COUNT_FILE=" + counts},
                                            .key = (scratch / "key").string()});
  EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
  EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
  const std::string said = file_bytes(counts);
  std::printf("%s%s%s", said.c_str(), session[Program::kMaster].out().c_str(), session[Program::kSlave].out().c_str());
  for (const Program program : {Program::kMaster, Program::kSlave}) {
    const std::size_t line = said.find(std::string("farhand-count farhand-") + role_of(program) + " pid ");
    ASSERT_NE(line, std::string::npos);
    EXPECT_TRUE(said.substr(line, said.find('\n', line) - line).ends_with(" heap 0 locks 0"));
  }
  session.stop();
}

}  // namespace
}  // namespace farhand
