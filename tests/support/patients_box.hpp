// The three latched timers (network, serial line, MCU) through every path that arms them and past everything that must
// not feed them, and the patient's stop through its three ways: the patient's box as the program runs it, from
// datagrams to the MCU core, in virtual time. The therapist is a stream of packets that says whatever the test wants.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <deque>
#include <functional>

#include "common/config/station_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/runtime/act_sources.hpp"
#include "common/runtime/side_of.hpp"
#include "common/runtime/station_loop.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {

using S = StationState;
using Bytes = std::vector<std::uint8_t>;

inline constexpr Nanoseconds kSerial = 1'500'000;  // one frame on its way, adapter included: the scene's default

inline const LoadedScene& the_scene() {
  static const LoadedScene loaded =
      load_scene("sea_four_channel", std::vector<std::string>{"slave.hand={stiffness_nm_per_rad: 5}"});
  return loaded;
}

struct Orthosis {
  OrthosisOnSerial on_serial{emulator_params(the_scene().scene), to_seconds(kSerial)};
  bool to_mcu = true, plugged = true;
  std::function<Bytes(const Bytes&)> from_mcu = [](const Bytes& bytes) { return bytes; };
};

class Cable {
 public:
  explicit Cable(Orthosis& orthosis) : orthosis_(orthosis) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    const Nanoseconds now = from_seconds(t_s);
    orthosis_.on_serial.advance(now);
    Bytes came;
    for (std::uint8_t byte = 0; orthosis_.on_serial.receive(now, byte);) came.push_back(byte);
    if (orthosis_.plugged && now > read_) {
      for (const std::uint8_t byte : orthosis_.from_mcu(came)) waiting_.push_back(byte);
    }
    read_ = now;
    const std::size_t count = std::min(bytes.size(), waiting_.size());
    std::copy_n(waiting_.begin(), count, bytes.begin());
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  bool write(std::span<const std::uint8_t> bytes, double t_s) noexcept {
    if (orthosis_.to_mcu && orthosis_.plugged) orthosis_.on_serial.send(bytes.data(), bytes.size(), from_seconds(t_s));
    return orthosis_.plugged;
  }
  void drop_unsent(double t_s) noexcept { orthosis_.on_serial.drop_unsent(from_seconds(t_s)); }
  bool lost() noexcept { return !orthosis_.plugged; }

 private:
  Orthosis& orthosis_;
  std::deque<std::uint8_t> waiting_;
  Nanoseconds read_ = -1;
};

// What the socket would hold: the oldest 277, as Linux keeps of small datagrams by default.
class Inbox final : public PeerLink {
 public:
  void put(std::span<const std::byte> bytes) {
    if (waiting_.size() < 277) waiting_.emplace_back(bytes.begin(), bytes.end());
  }
  void put_handshake() { waiting_.emplace_back(); }

  void advance(Nanoseconds) noexcept override {}
  Received receive(std::span<std::byte> buffer, Nanoseconds, std::span<const std::byte>& packet) noexcept override {
    if (waiting_.empty()) return Received::kNothing;
    const std::vector<std::byte> bytes = waiting_.front();
    waiting_.pop_front();
    if (bytes.empty()) return Received::kOther;
    packet = buffer.first(std::min(buffer.size(), bytes.size()));
    std::copy_n(bytes.begin(), packet.size(), buffer.begin());
    return Received::kPacket;
  }
  void accept() noexcept override {}
  bool send(std::span<const std::byte>) noexcept override { return true; }
  bool called(Nanoseconds) noexcept override { return true; }
  const UdpSocket& socket() const noexcept override { std::abort(); }

 private:
  std::deque<std::vector<std::byte>> waiting_;
};

struct Ends {
  Ends() { EXPECT_EQ(pipe2(fd, O_CLOEXEC), 0); }
  ~Ends() { close(fd[0]), finish(); }
  void say(const std::string& text) { EXPECT_EQ(write(fd[1], text.data(), text.size()), ssize_t(text.size())); }
  void finish() { close(std::exchange(fd[1], -1)); }
  int fd[2];
};

class Box {
 public:
  Box() {
    for (int k = 0; k < 50; ++k) tick();
    restart_therapist();
  }

  // The therapist: what is sent in each tick, or instead of it. Every second number is left out, so that there are
  // some that have never been seen.
  S says = S::kReady;
  bool network = true;
  Packet<1> stream{.session = 1, .seq = 1000, .motion = {}};
  std::function<void()> instead;

  Orthosis orthosis;
  Ends keys, pedal;
  Inbox inbox;
  Nanoseconds now = -kMillisecond;  // of the tick that was last

  void restart_therapist() {
    ++stream.session;
    stream.seq = 1000;
    clock_ += 1234 * kSecond;
    says = S::kReady;
  }
  void set_therapists_clock(Nanoseconds by) { clock_ += by; }
  Packet<1> next_packet() {
    if (says == S::kEngaged && stream.state != S::kEngaged) engaged_at_ = now;
    stream.seq += 2;
    stream.send_time_ns = now + clock_;
    stream.state = says;
    stream.expiry_ms = 2000;
    if (says != S::kEngaged) x_ = side->trace().local.x[0];  // aligned
    const double ahead = std::clamp(to_seconds(now - engaged_at_), 0.0, 1.0);
    stream.motion.x[0] = says == S::kEngaged ? x_ + 0.15 * ahead * ahead * (3 - 2 * ahead) : x_;
    stream.motion.f[0] = -5 * stream.motion.x[0];
    return stream;
  }
  void deliver(const Packet<1>& packet) { inbox.put(codec_.encode(packet)); }

  void send() {
    if (instead) return instead();
    const Packet<1> packet = next_packet();
    if (network) deliver(packet);
    if (network) heard = now;
  }
  void tick(std::uint64_t missed = 0) {
    now += kMillisecond;
    send();
    run(missed);
  }
  // The process is stopped; everybody else goes on.
  void sleep(int ms) {
    for (int k = 0; k < ms; ++k) now += kMillisecond, send();
    orthosis.on_serial.advance(now);
    tick(static_cast<std::uint64_t>(ms));
  }
  void ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
  }

  // What an operator does: wait until all is settled, then engage. True with torque on the hand.
  bool engage() {
    says = S::kReady;
    ticks(1100);
    says = S::kEngaged;
    ticks(900);
    return state() == S::kEngaged && std::abs(torque()) > 0.3;
  }

  // How long after the call the condition came true, asked after each tick; -1 if not within two seconds.
  Nanoseconds until(const std::function<bool()>& condition) {
    const Nanoseconds from = now;
    while (!condition() && now < from + 2 * kSecond) tick();
    return condition() ? now - from : -1;
  }

  S state() const { return side->trace().state; }
  Reason reason() const { return side->trace().reason; }
  const OrthosisEmulator& mcu() { return orthosis.on_serial.emulator(); }
  mcu::State mcu_state() { return mcu().output().state; }
  double torque() { return mcu::to_nm(mcu().core().torque_command()); }

  Nanoseconds heard = 0;
  std::unique_ptr<SideOf<McuAxis<Cable>>> side =
      std::make_unique<SideOf<McuAxis<Cable>>>(slave_station_params(the_scene().scene, 2), orthosis);

 private:
  void run(std::uint64_t missed) {
    TickTime time;
    time.now_ns = time.deadline_ns = time.elapsed_ns = now;
    time.index = index_++;
    time.missed = missed;
    EXPECT_TRUE(loop_(time));
  }

  OperatorInput keys_{keys.fd[0]};
  StopInput pedal_{"fd:" + std::to_string(pedal.fd[0])};
  PatientsStop stop_{pedal_};
  OperatorsWords words_{keys_};
  ScenesPeople people_{the_scene().scene, Role::kFollower};
  std::array<ActSource*, 3> acts_{&stop_, &words_, &people_};
  PacketCodec<1> codec_;
  StationLoop loop_{*side, 1e6, {.link = &inbox, .acts = acts_, .watchers = {}}};
  Nanoseconds clock_ = 77 * kSecond;  // the therapist's, ahead of ours
  Nanoseconds engaged_at_ = 0;
  double x_ = 0;
  std::uint64_t index_ = 0;
};

}  // namespace farhand
