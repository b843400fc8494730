// The three latched timers (network, serial line, MCU) through every path that arms them, and past everything that must
// not feed them.
#include "tests/support/patients_box.hpp"

namespace farhand {
namespace {

// Every path on which the timers are armed. Each leaves the box engaged again.
struct Path {
  const char* name;
  void (*take)(Box&);
};
const Path kPaths[] = {
    {"first engagement", [](Box&) {}},
    {"after the therapist held", [](Box& box) { box.says = S::kHolding, box.ticks(300); }},
    {"after the therapist let go", [](Box& box) { box.says = S::kReady, box.ticks(300); }},
    {"after the network was out", [](Box& box) { box.network = false, box.ticks(500), box.network = true; }},
    {"after two minutes' outage",
     [](Box& box) { box.network = false, box.ticks(500), box.now += 120 * kSecond, box.sleep(1), box.network = true; }},
    {"after the therapist restarted", [](Box& box) { box.restart_therapist(), box.ticks(300); }},
    {"after the therapist's clock was set forward",
     [](Box& box) { box.set_therapists_clock(50 * kMillisecond), box.ticks(300); }},
    {"after the patient's stop and reset",
     [](Box& box) { box.keys.say("stop\n"), box.ticks(300), box.keys.say("reset\n"), box.ticks(300); }},
    {"after the MCU's stop and release",
     [](Box& box) {
       OrthosisEmulator& mcu = box.orthosis.on_serial.emulator();
       mcu.press_stop(true), box.ticks(300), mcu.press_stop(false), box.ticks(10);
       mcu.press_release(true), box.ticks(200), mcu.press_release(false);
     }},
    {"after the cable was pulled and put back",
     [](Box& box) { box.orthosis.plugged = false, box.ticks(300), box.orthosis.plugged = true; }},
    {"after the MCU restarted", [](Box& box) { box.orthosis.on_serial.emulator().reset_mcu(), box.ticks(300); }},
    {"after the MCU heard nothing",
     [](Box& box) { box.orthosis.to_mcu = false, box.ticks(300), box.orthosis.to_mcu = true; }},
    {"after the host slept 40 ms", [](Box& box) { box.sleep(40), box.ticks(300); }},
    {"after the host slept 3 s", [](Box& box) { box.sleep(3000), box.ticks(300); }},
};

class Timers : public testing::TestWithParam<Path> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(box.engage());
    GetParam().take(box);
    ASSERT_TRUE(box.engage()) << name_of(box.state()) << ", " << name_of(box.reason());
  }
  // The therapist's stream still says that it is engaged, and that alone brings nothing back.
  void expect_latched() {
    for (int k = 0; k < 1200; ++k) {
      box.tick();
      ASSERT_NE(box.state(), S::kEngaged);
    }
    ASSERT_TRUE(box.engage()) << "the way back is the operator's";
  }

  Box box;
};
std::string name_of_case(const testing::TestParamInfo<Path>& info) {
  std::string name;
  for (const char* c = info.param.name; *c != 0; ++c) name += std::isalnum(static_cast<unsigned char>(*c)) ? *c : '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Path, Timers, testing::ValuesIn(kPaths), name_of_case);

TEST_P(Timers, TheNetworkHoldsAfter100MillisecondsAndATickAndStays) {
  box.network = false;
  EXPECT_EQ(box.until([&] { return box.state() != S::kEngaged; }) + box.now - box.heard, 2 * 101 * kMillisecond);
  EXPECT_EQ(box.state(), S::kHolding);
  EXPECT_EQ(box.reason(), Reason::kPeerSilent);
  box.network = true;
  expect_latched();
}

TEST_P(Timers, TheSerialLineLetsGoAfter50MillisecondsAndATickAndStays) {
  box.orthosis.from_mcu = [](const Bytes&) { return Bytes(); };
  const Nanoseconds took = box.until([&] { return box.state() != S::kEngaged; });
  EXPECT_TRUE(took == 51 * kMillisecond || took == 50 * kMillisecond) << took;
  EXPECT_EQ(box.reason(), Reason::kDeviceLost);
  box.orthosis.from_mcu = [](const Bytes& bytes) { return bytes; };
  expect_latched();
}

TEST_P(Timers, TheMcuLetsGoAfter20And50MillisecondsSaysSoAndStays) {
  const Nanoseconds last = box.now + kSerial;  // arrival of the last frame
  box.orthosis.to_mcu = false;
  box.until([&] { return !box.mcu().core().driven(); });
  EXPECT_GE(box.now - last, 20 * kMillisecond - kMillisecond);
  EXPECT_LE(box.now - last, 20 * kMillisecond + kMillisecond);
  box.until([&] { return box.torque() == 0; });
  EXPECT_LE(box.now - last, 22 * kMillisecond + kMillisecond);
  box.until([&] { return box.mcu_state() == mcu::State::kSafe; });
  EXPECT_EQ(box.torque(), 0);
  EXPECT_LE(box.now - last, 70 * kMillisecond + kMillisecond);
  box.ticks(20);  // the page of faults comes by
  EXPECT_EQ(box.side->axis().slow().faults(), mcu::kWatchdog);
  EXPECT_NE(box.state(), S::kEngaged);
  box.orthosis.to_mcu = true;
  expect_latched();
}

TEST(TimersFed, ByNothingYetNobodyIsAlive) {
  Box box;
  box.network = false;
  Orthosis& orthosis = box.orthosis;
  orthosis.from_mcu = [](const Bytes&) { return Bytes(); };
  box.restart_therapist();
  box.ticks(3000);
  EXPECT_NE(box.state(), S::kEngaged);
  EXPECT_EQ(box.torque(), 0);
}

// What comes instead of the therapist's packets. `k` counts the ticks of it.
struct Feed {
  const char* name;
  void (*send)(Box&, std::uint32_t k, const Packet<1>& last);
};
const Feed kNotFeeding[] = {
    {"nothing", [](Box&, std::uint32_t, const Packet<1>&) {}},
    {"the last one again", [](Box& box, std::uint32_t, const Packet<1>& last) { box.deliver(last); }},
    {"a replay of the last second",
     [](Box& box, std::uint32_t k, const Packet<1>& last) {
       Packet<1> packet = last;
       packet.seq -= 2 * (1000 - k), packet.send_time_ns -= (1000 - k) * kMillisecond;
       box.deliver(packet);
     }},
    {"never seen, but behind what is shown",
     [](Box& box, std::uint32_t k, const Packet<1>& last) {
       Packet<1> packet = last;
       packet.seq -= 2 * (1000 - k) + 1, packet.send_time_ns -= (1000 - k) * kMillisecond + kMillisecond / 2;
       box.deliver(packet);
     }},
    {"older than its sender allows",
     [](Box& box, std::uint32_t, const Packet<1>&) {
       Packet<1> packet = box.next_packet();
       packet.send_time_ns -= 60 * kMillisecond, packet.expiry_ms = 50;
       box.deliver(packet);
     }},
    {"older than we allow",
     [](Box& box, std::uint32_t, const Packet<1>&) {
       Packet<1> packet = box.next_packet();
       packet.send_time_ns -= 2100 * kMillisecond, packet.expiry_ms = 0;
       box.deliver(packet);
     }},
    {"of a clock that was set back",
     [](Box& box, std::uint32_t, const Packet<1>&) {
       Packet<1> packet = box.next_packet();
       packet.send_time_ns -= 3600 * kSecond;
       box.deliver(packet);
     }},
    {"newer numbers with an older stamp",
     [](Box& box, std::uint32_t, const Packet<1>& last) {
       Packet<1> packet = box.next_packet();
       packet.send_time_ns = last.send_time_ns;
       box.deliver(packet);
     }},
    {"not a number",
     [](Box& box, std::uint32_t, const Packet<1>&) {
       Packet<1> packet = box.next_packet();
       packet.motion.v[0] = std::nan("");
       box.deliver(packet);
     }},
    {"of the session before",
     [](Box& box, std::uint32_t, const Packet<1>&) {
       Packet<1> packet = box.next_packet();
       --packet.session;
       box.deliver(packet);
     }},
    {"a bit flipped",
     [](Box& box, std::uint32_t k, const Packet<1>&) {
       PacketCodec<1> codec;
       const auto good = codec.encode(box.next_packet());
       std::vector<std::byte> bytes(good.begin(), good.end());
       bytes[k % bytes.size()] ^= std::byte(1 << (k % 8));
       box.inbox.put(bytes);
     }},
    {"cut short",
     [](Box& box, std::uint32_t k, const Packet<1>&) {
       PacketCodec<1> codec;
       const auto good = codec.encode(box.next_packet());
       box.inbox.put(good.first(1 + k % (good.size() - 1)));
     }},
    {"handshakes", [](Box& box, std::uint32_t, const Packet<1>&) { box.inbox.put_handshake(); }},
};

TEST(TimersFed, NothingButAFreshPacketFeedsTheNetworks) {
  for (const Feed& feed : kNotFeeding) {
    SCOPED_TRACE(feed.name);
    Box box;
    ASSERT_TRUE(box.engage());
    const Packet<1> last = box.stream;
    std::uint32_t k = 0;
    box.instead = [&] { feed.send(box, k++, last); };
    EXPECT_EQ(box.until([&] { return box.state() != S::kEngaged; }), 101 * kMillisecond);
    EXPECT_EQ(box.reason(), Reason::kPeerSilent);
    box.ticks(800);
    EXPECT_EQ(box.state(), S::kHolding);
  }
}

// One that overtook the others, one in a hundred milliseconds, and one a moment before it expires are fresh.
TEST(TimersFed, AnyFreshPacketFeedsTheNetworks) {
  Box box;
  ASSERT_TRUE(box.engage());
  int k = 0;
  box.instead = [&] {
    Packet<1> packet = box.next_packet();
    if (++k % 100 == 0) box.deliver(packet);
  };
  for (int i = 0; i < 2000; ++i) {
    box.tick();
    ASSERT_EQ(box.state(), S::kEngaged) << i;
  }
}

// Kept in a queue for longer than the therapist allows, then all at once: nothing of it counts, though the peer is
// alive again with the first that is fresh.
TEST(TimersFed, AStallOfTheNetworkShowsNothingOld) {
  Box box;
  ASSERT_TRUE(box.engage());
  std::deque<Packet<1>> queue;
  box.instead = [&] { queue.push_back(box.next_packet()); };
  box.ticks(2100);
  EXPECT_EQ(box.state(), S::kHolding);
  const std::uint64_t received = box.side->receiver().counters().received;
  box.instead = [&] {
    for (int i = 0; i < 50; ++i) box.deliver(queue[static_cast<std::size_t>(i)]);
  };
  box.tick();
  EXPECT_EQ(box.side->receiver().counters().received, received);
  EXPECT_EQ(box.side->receiver().counters().rejected_expired, 50u);
  EXPECT_EQ(box.state(), S::kHolding);
}

// The host wakes up to a socket full of packets that are too young to be expired. It must not go on as if nothing had
// been, nor take the hand to where the therapist was.
TEST(TimersFed, AHostThatSleptHoldsWhateverLiesInItsSocket) {
  for (const int ms : {101, 300, 1500, 5000}) {
    Box box;
    ASSERT_TRUE(box.engage());
    box.sleep(ms);
    EXPECT_NE(box.state(), S::kEngaged) << ms;
    for (int k = 0; k < 1500; ++k) {
      box.tick();
      ASSERT_NE(box.state(), S::kEngaged) << ms;
    }
    EXPECT_EQ(box.torque(), 0);
    EXPECT_TRUE(box.engage()) << "no repair is needed";
  }
}

// A session that begins engaged is one that nobody saw come.
TEST(TimersFed, AnotherSessionThatIsEngagedAtOnceHolds) {
  Box box;
  ASSERT_TRUE(box.engage());
  ++box.stream.session;
  box.tick();
  EXPECT_EQ(box.state(), S::kHolding);
  box.ticks(1500);
  EXPECT_EQ(box.state(), S::kHolding);
}

// What comes from the MCU instead of its frames, or to it.
struct Line {
  const char* name;
  std::function<Bytes(const Bytes&)> spoil;
};
std::vector<Line> spoiled_lines() {
  auto count = std::make_shared<std::size_t>(0);
  auto kept = std::make_shared<Bytes>();
  return {
      {"nothing", [](const Bytes&) { return Bytes(); }},
      {"the last frame again and again",
       [kept](const Bytes& frame) {
         if (kept->empty() && !frame.empty() && frame.back() == 0 && frame.size() == 10) *kept = frame;
         return *kept;
       }},
      {"a bit flipped in each",
       [count](Bytes bytes) {
         for (std::uint8_t& byte : bytes) {
           if (byte == 0) continue;
           if (++*count % 9 == 0) byte = static_cast<std::uint8_t>(byte ^ 0x10);
         }
         return bytes;
       }},
      {"without their first byte",
       [](const Bytes& bytes) { return bytes.size() < 2 ? Bytes() : Bytes(bytes.begin() + 1, bytes.end()); }},
      {"zeros", [](const Bytes&) { return Bytes(11, 0); }},
      {"noise",
       [count](const Bytes&) {
         Bytes noise(11);
         for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>((*count += 0x9E3779B97F4A7C15u) >> 56);
         return noise;
       }},
  };
}

TEST(TimersFed, NothingButTheNextFrameFeedsTheSerialLines) {
  for (const Line& line : spoiled_lines()) {
    SCOPED_TRACE(line.name);
    Box box;
    ASSERT_TRUE(box.engage());
    box.orthosis.from_mcu = line.spoil;
    const Nanoseconds took = box.until([&] { return box.state() != S::kEngaged; });
    EXPECT_GE(took, 50 * kMillisecond);
    EXPECT_LE(took, 53 * kMillisecond);  // a frame that was half there
    EXPECT_EQ(box.reason(), Reason::kDeviceLost);
  }
}

}  // namespace
}  // namespace farhand
