// A tick under a flood: a link that never runs dry, and one on which each packet comes with ten that are none.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/record/sample_codec.hpp"
#include "common/runtime/act_sources.hpp"
#include "common/runtime/station_loop.hpp"
#include "common/runtime/tick_watchers.hpp"

namespace farhand {
namespace {

// What is received, in turn; the next of each tick begin anew.
class FloodedLink final : public PeerLink {
 public:
  int junk = 0;         // of others, before each packet
  int garbage = 0;      // authentic and undecodable, before each packet
  bool endless = true;  // and never a packet
  int asked = 0, most_asked = 0;

  void advance(Nanoseconds now) noexcept override {
    now_ = now;
    asked = 0;
  }
  Received receive(std::span<std::byte>, Nanoseconds, std::span<const std::byte>& packet) noexcept override {
    most_asked = std::max(most_asked, ++asked);
    if (endless || asked <= junk) return Received::kOther;
    if (asked > junk + garbage + 1) return Received::kNothing;
    packet = asked <= junk + garbage ? std::span<const std::byte>(garbage_)
                                     : codec_.encode({.session = 9, .seq = ++seq_, .send_time_ns = now_, .motion = {}});
    return Received::kPacket;
  }
  void accept() noexcept override {}
  bool send(std::span<const std::byte>) noexcept override { return true; }
  bool called(Nanoseconds) noexcept override { return true; }
  LinkDrops drops() const noexcept override { return dropped; }
  const UdpSocket& socket() const noexcept override { return socket_; }

  LinkDrops dropped;

 private:
  PacketCodec<1> codec_;
  std::array<std::byte, PacketCodec<1>::kSize> garbage_{};
  UdpSocket socket_ = UdpSocket::listen(parse_endpoint("127.0.0.1:0", EndpointUse::kListen));
  std::uint32_t seq_ = 0;
  Nanoseconds now_ = 0;
};

struct Flooded {
  LoadedScene loaded = load_scene("zero_delay");
  std::unique_ptr<Side> side = make_simulated_master(loaded.scene, 1);
  int silent = ::open("/dev/null", O_RDONLY);
  OperatorInput nobody{silent};
  LiveStatusPrinter status{true};
  OperatorsWords words{nobody};
  ScenesPeople people{loaded.scene, Role::kLeader};
  StatusWatcher line{status, Role::kLeader, {}};
  std::array<ActSource*, 2> acts{&words, &people};
  std::array<TickWatcher*, 1> watchers{&line};
  FloodedLink link;
  StationLoop loop{*side, 60, {.link = &link, .acts = acts, .watchers = watchers}};

  ~Flooded() { ::close(silent); }
  void tick(int count) {
    for (int i = 1; i <= count; ++i) {
      const Nanoseconds now = kSecond + i * kMillisecond;
      EXPECT_TRUE(loop({.now_ns = now,
                        .deadline_ns = now,
                        .elapsed_ns = i * kMillisecond,
                        .index = static_cast<std::uint64_t>(i - 1)}));
    }
  }
};

TEST(Flood, ThatNeverRunsDryGetsABoundedShareOfATick) {
  Flooded flooded;
  flooded.tick(100);
  EXPECT_EQ(flooded.link.most_asked, 256);
  EXPECT_FALSE(flooded.side->receiver().heard());
}

TEST(Flood, OfTwentyDatagramsForEachPacketLosesNone) {
  Flooded flooded;
  flooded.link.endless = false;
  flooded.link.junk = flooded.link.garbage = 10;
  flooded.tick(200);
  EXPECT_EQ(flooded.side->receiver().counters().received, 200u);
  EXPECT_EQ(flooded.link.most_asked, 22);
  EXPECT_EQ(flooded.loop.counters({}).rejected_format + flooded.loop.counters({}).rejected_checksum, 2000u);
}

TEST(Flood, EachKindOfDropIsCountedRecordedAndShown) {
  Flooded flooded;
  flooded.link.dropped = {.too_long = 1, .by_kernel = 20, .foreign = 300, .handshake = 4000, .send_failed = 50'000};
  StationCounters counted = flooded.loop.counters({});
  EXPECT_EQ(counted.cut_ticks, 0u);
  counted.cut_ticks = 600'000;
  record::Counters message;
  encode(counted, message);
  const StationCounters read = decode(message);
  for (const StationCounters& c : {counted, read}) {
    EXPECT_EQ(c.dropped_too_long, 1u);
    EXPECT_EQ(c.dropped_by_kernel, 20u);
    EXPECT_EQ(c.rejected_foreign, 300u);
    EXPECT_EQ(c.dropped_handshake, 4000u);
    EXPECT_EQ(c.send_failed, 50'000u);
    EXPECT_EQ(c.cut_ticks, 600'000u);
  }
  EXPECT_EQ(format_live_status({}).find("dropped"), std::string::npos) << "nothing to say";
  EXPECT_EQ(format_live_status({}).find("cut"), std::string::npos);
  EXPECT_NE(
      format_live_status({.dropped = 4321, .unsent = 50'000, .cut = 7}).find("  dropped 4321  not sent 50000  cut 7"),
      std::string::npos);
}

}  // namespace
}  // namespace farhand
