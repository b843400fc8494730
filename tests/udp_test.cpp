// The only path by which a peer speaks: addresses, refusals, and real datagrams over loopback.
#include "common/link/udp.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <string>
#include <vector>

namespace farhand {
namespace {

std::string refusal(std::string_view text, EndpointUse use = EndpointUse::kListen) {
  try {
    parse_endpoint(text, use);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(UdpEndpoint, ReadsNumericAddressesAndLocalhost) {
  for (const char* text : {"127.0.0.1:7000", "[::1]:0", "10.1.2.3:65535", "[fe80::1]:9"}) {
    EXPECT_EQ(to_string(parse_endpoint(text, EndpointUse::kListen)), text);
  }
  EXPECT_EQ(to_string(parse_endpoint("localhost:80", EndpointUse::kPeer)), "127.0.0.1:80");
  EXPECT_TRUE(parse_endpoint("[::1]:5", EndpointUse::kPeer).is_loopback());
  EXPECT_TRUE(parse_endpoint("127.9.9.9:5", EndpointUse::kPeer).is_loopback());
  for (const char* text : {"10.1.2.3:5", "0.0.0.0:5", "[::]:5", "[fe80::1]:5", "[::ffff:10.0.0.1]:5"}) {
    EXPECT_FALSE(parse_endpoint(text, EndpointUse::kPeer).is_loopback()) << text;
  }
}

TEST(UdpEndpoint, RefusesEverythingElseWithItsReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "port is missing"},
      {"127.0.0.1", "port is missing"},
      {"[::1]", "port is missing"},
      {"[::1]7000", "port is missing"},
      {"[::1:7000", "not closed"},
      {":7000", "address is missing"},
      {"[]:7000", "address is missing"},
      {"::1:7000", "needs brackets"},
      {"127.0.0.1:", "not a whole number"},
      {"127.0.0.1:70000", "from 0 to 65535"},
      {"127.0.0.1:99999999999999999999", "not a whole number"},
      {"127.0.0.1:-1", "not a whole number"},
      {"127.0.0.1:+1", "not a whole number"},
      {"127.0.0.1:7000 ", "not a whole number"},
      {"127.0.0.1:0x10", "not a whole number"},
      {"127.0.0.1:7.5", "not a whole number"},
      {" 127.0.0.1:7000", "not a numeric address"},
      {"127.0.0:7000", "not a numeric address"},
      {"256.0.0.1:7000", "not a numeric address"},
      {"[127.0.0.1]:7000", "not a numeric address"},
      {"[localhost]:7000", "not a numeric address"},
      {"[::1%lo]:7000", "not a numeric address"},
      {"example.org:7000", "not looked up"},
  };
  for (const auto& [text, reason] : cases) {
    EXPECT_NE(refusal(text).find(reason), std::string::npos) << text << " -> " << refusal(text);
    EXPECT_NE(refusal(text).find(text), std::string::npos) << "the sentence names what was written";
  }
  EXPECT_NE(refusal("127.0.0.1:0", EndpointUse::kPeer).find("from 1 to 65535"), std::string::npos);
}

TEST(UdpEndpoint, WritesWhatItReadsForAnyAddress) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 10'000; ++i) {
    UdpEndpoint endpoint;
    endpoint.v6 = i % 2 == 0;
    for (std::size_t b = 0; b < (endpoint.v6 ? 16u : 4u); ++b)
      endpoint.address[b] = static_cast<std::uint8_t>(random() % (i % 4 < 2 ? 2 : 256));
    endpoint.port = static_cast<std::uint16_t>(random());
    EXPECT_EQ(parse_endpoint(to_string(endpoint), EndpointUse::kListen), endpoint) << to_string(endpoint);
  }
}

UdpSocket listen_on(const char* text) { return UdpSocket::listen(parse_endpoint(text, EndpointUse::kListen)); }

// Waits for the kernel, then receives; a stall of the machine only makes it slower.
std::optional<UdpSocket::Received> wait_and_receive(UdpSocket& socket, std::span<std::byte> buffer) {
  for (int i = 0; i < 50; ++i) {
    if (auto received = socket.receive(buffer); received && !received->dropped) return received;
    pollfd wait{socket.native_handle(), POLLIN, 0};
    poll(&wait, 1, 100);
  }
  return std::nullopt;
}

class OverLoopback : public testing::TestWithParam<const char*> {};

TEST_P(OverLoopback, CarriesBytesBothWaysOnceTheListenerAcceptedTheSender) {
  if (std::string(GetParam()) == "[::1]:0" && access("/proc/net/if_inet6", F_OK) != 0) GTEST_SKIP() << "no IPv6 here";
  UdpSocket listener = listen_on(GetParam());
  ASSERT_NE(listener.local_endpoint().port, 0);
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  std::vector<std::byte> bytes(100);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i);
  std::vector<std::byte> buffer(256);

  EXPECT_FALSE(listener.receive(buffer)) << "an empty socket is no error";
  EXPECT_FALSE(listener.send(bytes)) << "nobody to answer yet";
  EXPECT_TRUE(dialer.send(bytes));
  const auto received = wait_and_receive(listener, buffer);
  ASSERT_TRUE(received);
  EXPECT_EQ(received->size, bytes.size());
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), buffer.begin()));
  EXPECT_EQ(received->sender, dialer.local_endpoint());

  EXPECT_FALSE(listener.send(bytes)) << "receiving alone does not make a peer";
  listener.accept(received->sender);
  EXPECT_EQ(listener.peer(), dialer.local_endpoint());
  EXPECT_TRUE(listener.send(bytes));
  EXPECT_TRUE(wait_and_receive(dialer, buffer));
  EXPECT_EQ(listener.counters().errors + dialer.counters().errors, 0u);
  EXPECT_EQ(listener.counters().would_block, 0u);
}
INSTANTIATE_TEST_SUITE_P(Each, OverLoopback, testing::Values("127.0.0.1:0", "[::1]:0", "localhost:0"));

TEST(UdpSocket, AnswersTheNewestAcceptedPeer) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  UdpSocket first = UdpSocket::dial(listener.local_endpoint());
  UdpSocket second = UdpSocket::dial(listener.local_endpoint());
  const std::byte byte[] = {std::byte{1}};
  std::byte buffer[8];
  for (UdpSocket* dialer : {&first, &second}) {
    dialer->send(byte);
    listener.accept(wait_and_receive(listener, buffer).value().sender);
  }
  listener.send(byte);
  EXPECT_TRUE(wait_and_receive(second, buffer));
  EXPECT_FALSE(first.receive(buffer));
}

TEST(UdpSocket, ADialerHearsOnlyItsPeer) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  UdpSocket stranger = UdpSocket::dial(dialer.local_endpoint());
  const std::byte byte[] = {std::byte{1}};
  std::byte buffer[8];
  stranger.send(byte);
  listener.accept(dialer.local_endpoint());
  listener.send(byte);
  const auto received = wait_and_receive(dialer, buffer);
  ASSERT_TRUE(received);
  EXPECT_EQ(received->sender, listener.local_endpoint());
  EXPECT_FALSE(dialer.receive(buffer));
  dialer.accept(stranger.local_endpoint());
  EXPECT_EQ(dialer.peer(), listener.local_endpoint());
}

TEST(UdpSocket, APeerThatIsNotThereYetIsCountedAndNoError) {
  UdpEndpoint gone;
  {
    UdpSocket listener = listen_on("127.0.0.1:0");
    gone = listener.local_endpoint();
  }
  UdpSocket dialer = UdpSocket::dial(gone);
  const std::byte byte[] = {std::byte{1}};
  std::byte buffer[8];
  for (int i = 0; i < 10; ++i) {
    dialer.send(byte);
    const auto received = dialer.receive(buffer);
    EXPECT_TRUE(!received || received->dropped);
  }
  EXPECT_GE(dialer.counters().refused, 1u);
  EXPECT_EQ(dialer.counters().errors, 0u);

  UdpSocket listener = UdpSocket::listen(gone);
  dialer.send(byte);  // may still report an old refusal
  dialer.send(byte);
  EXPECT_TRUE(wait_and_receive(listener, buffer)) << "the socket survives the refusals";
}

TEST(UdpSocket, DropsADatagramLongerThanTheBufferWholeAndCountsIt) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  const std::vector<std::byte> long_one(65, std::byte{7}), exact(64, std::byte{8}), empty;
  dialer.send(long_one);
  dialer.send(exact);
  dialer.send(empty);
  std::byte buffer[64];
  const auto received = wait_and_receive(listener, buffer);
  ASSERT_TRUE(received);
  EXPECT_EQ(received->size, 64u);
  EXPECT_EQ(buffer[0], std::byte{8});
  EXPECT_EQ(wait_and_receive(listener, buffer).value().size, 0u);
  EXPECT_EQ(listener.counters().oversized, 1u);
}

TEST(UdpSocket, LongDatagramsDoNotHideThoseBehindThem) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  const std::vector<std::byte> long_one(600), packet(64, std::byte{8});
  constexpr int kLong = 60;
  for (int i = 0; i < kLong; ++i) dialer.send(long_one);
  dialer.send(packet);
  std::byte buffer[64];
  int dropped = 0;
  std::optional<UdpSocket::Received> received;
  for (int i = 0; i < 50 && dropped < kLong; ++i) {
    pollfd wait{listener.native_handle(), POLLIN, 0};
    poll(&wait, 1, 100);
    while ((received = listener.receive(buffer)) && received->dropped) ++dropped;
  }
  EXPECT_EQ(dropped, kLong) << "one call for each, none of which says that the queue is empty";
  EXPECT_EQ(listener.counters().oversized, static_cast<std::uint64_t>(kLong));
  EXPECT_TRUE(received || wait_and_receive(listener, buffer));
}

TEST_P(OverLoopback, TheKernelDropsWhatIsTooLongWithoutTakingRoomForItAndCounts) {
  if (std::string(GetParam()) == "[::1]:0" && access("/proc/net/if_inet6", F_OK) != 0) GTEST_SKIP() << "no IPv6 here";
  UdpSocket listener = listen_on(GetParam());
  if (!listener.refuse_longer_than(512)) GTEST_SKIP() << "this kernel filters nothing";
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  const std::vector<std::byte> longest(512, std::byte{7}), longer(513), huge(60'000);
  constexpr int kEach = 500;  // of 60 kB: many times what a socket holds
  for (int i = 0; i < kEach; ++i) {
    dialer.send(longer);
    dialer.send(huge);
    if (i % 100 == 0) dialer.send(longest);
  }
  std::byte buffer[512];
  for (int i = 0; i < kEach / 100; ++i) {
    const auto received = wait_and_receive(listener, buffer);
    ASSERT_TRUE(received) << i;
    EXPECT_EQ(received->size, longest.size());
    EXPECT_EQ(buffer[511], std::byte{7});
  }
  EXPECT_FALSE(listener.receive(buffer));
  EXPECT_EQ(listener.dropped_by_kernel(), 2u * kEach);
  EXPECT_EQ(listener.dropped_by_kernel(), 2u * kEach) << "asking counts nothing twice";
  EXPECT_EQ(listener.counters().oversized, 0u);
}

TEST(UdpSocket, WhatAFullSocketLosesIsCounted) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  const std::vector<std::byte> bytes(1000);
  constexpr std::uint64_t kSent = 20'000;
  for (std::uint64_t i = 0; i < kSent; ++i) dialer.send(bytes);
  std::byte buffer[1000];
  while (listener.receive(buffer)) {
  }
  EXPECT_GT(listener.dropped_by_kernel(), 0u);
  EXPECT_EQ(listener.counters().received + listener.dropped_by_kernel(), dialer.counters().sent);
}

TEST(UdpHost, IsTheAddressWithoutThePortAndTheNetworkOfIpv6) {
  const auto host = [](const char* text) { return host_of(parse_endpoint(text, EndpointUse::kPeer)); };
  EXPECT_EQ(host("10.1.2.3:1"), host("10.1.2.3:65535"));
  EXPECT_FALSE(host("10.1.2.3:1") == host("10.1.2.4:1"));
  EXPECT_EQ(host("[2001:db8:1:2::1]:1"), host("[2001:db8:1:2:ffff:ffff:ffff:ffff]:2"));
  EXPECT_FALSE(host("[2001:db8:1:2::1]:1") == host("[2001:db8:1:3::1]:1"));
  EXPECT_FALSE(host("[::]:1") == host("0.0.0.0:1"));
}

TEST(UdpSocket, RefusesAnythingButLoopbackBecauseTheLinkIsNotSecured) {
  for (const char* text : {"0.0.0.0:0", "[::]:0", "192.0.2.1:7000"}) {
    const UdpEndpoint endpoint = parse_endpoint(text, EndpointUse::kListen);
    for (const bool dial : {false, true}) {
      try {
        dial ? UdpSocket::dial(endpoint) : UdpSocket::listen(endpoint);
        FAIL() << text;
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("not secured"), std::string::npos) << error.what();
      }
    }
  }
}

TEST(UdpSocket, SaysWhichAddressAndPortAreBusy) {
  UdpSocket listener = listen_on("127.0.0.1:0");
  try {
    UdpSocket::listen(listener.local_endpoint());
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(to_string(listener.local_endpoint())), std::string::npos) << text;
    EXPECT_NE(text.find("Address already in use"), std::string::npos) << text;
    std::printf("%s\n", text.c_str());
  }
}

TEST(UdpSocket, SaysThatALowPortNeedsAPrivilege) {
  const uid_t before = geteuid();
  if (before == 0 && seteuid(65534) != 0) GTEST_SKIP() << "cannot give up root here";
  std::string text;
  try {
    listen_on("127.0.0.1:81");
  } catch (const std::runtime_error& error) {
    text = error.what();
  }
  ASSERT_TRUE(before != 0 || seteuid(before) == 0);
  if (text.empty()) GTEST_SKIP() << "low ports are open to everyone on this machine";
  EXPECT_NE(text.find("Permission denied"), std::string::npos) << text;
  EXPECT_NE(text.find("below 1024"), std::string::npos) << text;
}

}  // namespace
}  // namespace farhand
