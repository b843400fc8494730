// The secured link on real sockets. The loop owns the socket and the session in force; a second thread owns the
// handshakes, whose arithmetic takes milliseconds. Rings connect them, for which neither ever waits: datagrams of
// handshakes in both directions, new sessions to the loop, ended sessions to the thread.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <exception>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/exchange/spsc_ring.hpp"
#include "common/runtime/peer_link.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/secure/handshaker.hpp"
#include "common/secure/host_budget.hpp"

namespace farhand {
namespace {

constexpr int kHandshakeDatagramsPerTick = 8;
constexpr int kLongestNap_ms = 50;  // a quarter of the first repetition of a handshake
constexpr Nanoseconds kSaidAgain = 10 * kSecond;

class SecuredLink final : public PeerLink {
 public:
  SecuredLink(UdpSocket socket, const PairingKey& key, const Greeting& own, std::string program)
      : socket_(std::move(socket)),
        program_(std::move(program)),
        channel_(socket_.peer() ? LinkEnd::kDialer : LinkEnd::kListener),
        handshaker_(socket_.peer() ? Handshaker::dialer(key, own, *socket_.peer()) : Handshaker::listener(key, own)),
        wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    socket_.refuse_longer_than(MediaSession::kLargestDatagram);
    if (wake_ < 0) throw std::runtime_error("the system gives no event descriptor for the secured link");
    thread_ = std::thread([this] { shake_hands(); });
  }

  ~SecuredLink() override {
    stop_ = true;
    wake();
    thread_.join();
    ::close(wake_);
    for (MediaSession* session = nullptr; made_.pop(session);) delete session;
    for (MediaSession* session = nullptr; over_.pop(session);) delete session;
  }

  void advance(Nanoseconds now) noexcept override {
    // Ended sessions go first: each gives its place to a new one.
    while (std::unique_ptr<MediaSession> session = channel_.retire(now)) give_back(std::move(session));
    if (MediaSession* session = nullptr; made_.pop(session)) {
      give_back(channel_.offer(std::unique_ptr<MediaSession>(session), now));
    }
    // Only a few answers per tick, so that a flood of hellos does not make the tick late.
    HandshakeDatagram datagram;
    for (int i = 0; i < kHandshakeDatagramsPerTick && outgoing_.pop(datagram); ++i) {
      socket_.send_to(datagram.view(), datagram.peer);
    }
  }

  Received receive(std::span<std::byte> buffer, Nanoseconds now, std::span<const std::byte>& packet) noexcept override {
    const std::optional<UdpSocket::Received> datagram = socket_.receive(buffer);
    if (!datagram) return Received::kNothing;
    if (datagram->dropped) return Received::kOther;
    std::span<std::byte> opened;
    switch (channel_.open(buffer.first(datagram->size), datagram->sender, now, opened)) {
      case SecureChannel::Incoming::kPacket:
        packet = opened;
        return Received::kPacket;
      case SecureChannel::Incoming::kHandshake:
        // Without room the datagram is lost as on the network, and an honest sender repeats it.
        if (budget_.take(datagram->sender, now) &&
            incoming_.push(to_datagram(datagram->sender, buffer.first(datagram->size)))) {
          wake();
        } else {
          ++handshakes_dropped_;
        }
        return Received::kOther;
      case SecureChannel::Incoming::kRejected:
        break;
    }
    return Received::kOther;
  }

  void accept() noexcept override {}

  bool send(std::span<const std::byte> packet) noexcept override {
    const std::span<const std::byte> sealed = channel_.seal(packet);
    return !sealed.empty() && socket_.send_to(sealed, channel_.peer());
  }

  bool called(Nanoseconds now) noexcept override {
    advance(now);
    alignas(8) std::array<std::byte, MediaSession::kLargestDatagram> buffer;
    std::span<const std::byte> packet;
    for (int i = 0; i < 256; ++i) {
      const Received received = receive(buffer, now, packet);
      if (received == Received::kPacket) return true;
      if (received == Received::kNothing) return false;
    }
    return false;
  }

  bool refused() const noexcept override { return refused_.load(std::memory_order_acquire); }
  const ChannelCounters* security() const noexcept override { return &channel_.counters(); }
  LinkDrops drops() const noexcept override {
    LinkDrops drops = drops_of(socket_);
    drops.handshake = handshakes_dropped_ + answers_dropped_.load(std::memory_order_relaxed);
    drops.foreign = channel_.counters().foreign + channel_.counters().no_session;
    return drops;
  }
  const UdpSocket& socket() const noexcept override { return socket_; }

 private:
  void wake() noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t ignored = ::write(wake_, &one, sizeof one);
  }

  // A session is destroyed in the handshake thread, where freeing memory delays no tick. It is destroyed here only if
  // that thread has 16 of them waiting.
  void give_back(std::unique_ptr<MediaSession> session) noexcept {
    if (session == nullptr || !over_.push(session.get())) return;
    static_cast<void>(session.release());
    wake();
  }

  void shake_hands() {
    while (!stop_) {
      try {
        step(monotonic_now());
      } catch (const std::exception& error) {
        say(error.what(), monotonic_now(), false);
      }
      pollfd woken{wake_, POLLIN, 0};
      ::poll(&woken, 1, kLongestNap_ms);
      std::uint64_t count = 0;
      [[maybe_unused]] const ssize_t ignored = ::read(wake_, &count, sizeof count);
    }
  }

  void step(Nanoseconds now) {
    // Ended sessions first: a dialer calls again once it has none.
    for (MediaSession* session = nullptr; over_.pop(session);) {
      handshaker_->give_back(std::unique_ptr<MediaSession>(session), now);
    }
    // Handshakes: received datagrams, repetitions by time, then the answers.
    HandshakeDatagram datagram;
    while (incoming_.pop(datagram)) handshaker_->receive(datagram, now);
    handshaker_->advance(now);
    while (handshaker_->take_outgoing(datagram)) {
      if (!outgoing_.push(datagram)) answers_dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    // New sessions go to the loop, which alone decides which one is in force.
    while (std::unique_ptr<MediaSession> session = handshaker_->take_session()) {
      if (made_.push(session.get())) {
        static_cast<void>(session.release());
      } else {
        handshaker_->give_back(std::move(session), now);
      }
    }
    while (const std::optional<HandshakeEvent> event = handshaker_->take_event()) tell(*event, now);
  }

  void tell(const HandshakeEvent& event, Nanoseconds now) {
    if (event.kind == HandshakeEvent::Kind::kAgreed) return;
    const bool refused = event.kind == HandshakeEvent::Kind::kRefused;
    say("no secured link with " + to_string(event.peer) + ": " + (refused ? "refused, " : "") + event.why, now,
        refused);
    if (refused) refused_.store(true, std::memory_order_release);
  }

  // Strangers must not fill the terminal: a sentence is printed at most every kSaidAgain, except that a new sentence
  // about an `authentic` peer is printed at once.
  void say(const std::string& sentence, Nanoseconds now, bool authentic) {
    const bool news = authentic && sentence != said_;
    if (!news && said_at_ != 0 && now - said_at_ < kSaidAgain) return;
    std::fprintf(stderr, "%s: %s\n", program_.c_str(), sentence.c_str());
    said_ = sentence;
    said_at_ = now;
  }

  // The loop's.
  UdpSocket socket_;
  std::string program_;
  SecureChannel channel_;
  HostBudget budget_{std::random_device{}()};
  std::uint64_t handshakes_dropped_ = 0;

  // Between.
  SpscRing<HandshakeDatagram> incoming_{64}, outgoing_{64};
  SpscRing<MediaSession*> made_{16}, over_{16};
  std::atomic<bool> stop_{false}, refused_{false};
  std::atomic<std::uint64_t> answers_dropped_{0};

  // The handshake thread's.
  std::unique_ptr<Handshaker> handshaker_;
  std::string said_;
  Nanoseconds said_at_ = 0;

  int wake_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<PeerLink> make_secured_link(UdpSocket socket, const PairingKey& key, const Greeting& own,
                                            const std::string& program) {
  return std::make_unique<SecuredLink>(std::move(socket), key, own, program);
}

}  // namespace farhand
