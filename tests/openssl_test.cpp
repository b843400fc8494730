// Our listener against the handshake of somebody else: openssl s_client, over a real socket. With the right key it
// agrees on the same keys of SRTP; everything weaker is refused.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>

#include "common/link/udp.hpp"
#include "common/secure/dtls.hpp"
#include "tests/support/child_process.hpp"

namespace farhand {
namespace {

using Arguments = std::vector<std::string>;

const std::string kSecret = "00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff";
const PairingKey kKey = PairingKey::from_text(kSecret);

std::string upper_hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02X", byte);
    text += digits;
  }
  return text;
}

struct Outcome {
  bool heard = false;      // a handshake came
  bool connected = false;  // as the listener sees it
  std::string srtp_keys;   // hexadecimal
  std::string said;        // by openssl
};

// The arguments that differ from case to case come last, where s_client lets them win.
Outcome call_with(const Arguments& arguments, double patience_s) {
  UdpSocket socket = UdpSocket::listen(parse_endpoint("127.0.0.1:0", EndpointUse::kListen));
  Arguments command{"/usr/bin/env",
                    "openssl",
                    "s_client",
                    "-connect",
                    to_string(socket.local_endpoint()),
                    "-keymatexport",
                    "EXTRACTOR-dtls_srtp",
                    "-keymatexportlen",
                    "56"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  ChildProcess client(command);
  DtlsContext context(LinkEnd::kListener, kKey);
  Dtls dtls(context);
  bool verified = false;
  Outcome outcome;
  const auto answer = [&](const UdpEndpoint& to) {
    for (const Bytes& bytes : dtls.take_written()) socket.send_to(bytes, to);
  };
  std::array<std::byte, 2048> buffer;
  for (int look = 0; look * 0.05 < patience_s && client.running() && !outcome.connected; ++look) {
    while (const auto received = socket.receive(buffer)) {
      if (received->dropped) continue;
      outcome.heard = true;
      const std::span<const std::byte> datagram = std::span(buffer).first(received->size);
      if (!verified) {
        verified = dtls.listen(datagram, received->sender);
        if (verified) dtls.step();
      } else {
        dtls.step(datagram);
      }
      answer(received->sender);
    }
    outcome.connected = dtls.state() == Dtls::State::kConnected;
    if (dtls.state() == Dtls::State::kFailed)
      patience_s = std::min(patience_s, 0.05 * look + 0.3);  // it may still say why
    pollfd ready{socket.native_handle(), POLLIN, 0};
    if (!outcome.connected) ::poll(&ready, 1, 50);
  }
  if (outcome.connected) {
    const SrtpKeys keys = dtls.srtp_keys();
    outcome.srtp_keys = upper_hex(keys.bytes);
    while (client.running() && client.read_line().find("Keying material: ") == std::string::npos) {
    }
  }
  client.send_signal(SIGKILL);
  client.wait();
  outcome.said = client.out() + client.err();
  return outcome;
}

const Arguments kGood{
    "-dtls1_2",  "-psk_identity",        kKey.identity(), "-psk", kSecret, "-cipher", "ECDHE-PSK-CHACHA20-POLY1305",
    "-use_srtp", "SRTP_AEAD_AES_128_GCM"};

Arguments good_but(const Arguments& change) {
  Arguments arguments = kGood;
  arguments.insert(arguments.end(), change.begin(), change.end());
  return arguments;
}

TEST(OpenSslClient, AgreesOnTheSameKeysWithTheRightKey) {
  const Outcome outcome = call_with(kGood, 20);
  EXPECT_TRUE(outcome.connected) << outcome.said;
  EXPECT_NE(outcome.said.find("Cipher is ECDHE-PSK-CHACHA20-POLY1305"), std::string::npos) << outcome.said;
  EXPECT_NE(outcome.said.find("SRTP Extension negotiated, profile=SRTP_AEAD_AES_128_GCM"), std::string::npos);
  EXPECT_EQ(outcome.srtp_keys.size(), 112u);
  EXPECT_NE(outcome.said.find(outcome.srtp_keys), std::string::npos) << outcome.said;
}

TEST(OpenSslClient, IsRefusedWithAnythingWeaker) {
  Arguments without_srtp(kGood.begin(), kGood.end() - 2);
  Arguments old_version = good_but({"-cipher", "ECDHE-PSK-AES128-CBC-SHA:@SECLEVEL=0"});
  old_version[0] = "-dtls1";
  const std::pair<const char*, Arguments> cases[] = {
      {"a wrong key", good_but({"-psk", std::string(64, '1')})},
      {"an unknown identity", good_but({"-psk_identity", "somebody"})},
      {"a plain PSK suite", good_but({"-cipher", "PSK-CHACHA20-POLY1305:PSK-AES256-GCM-SHA384"})},
      {"another ECDHE suite", good_but({"-cipher", "ECDHE-PSK-AES256-CBC-SHA384"})},
      {"no PSK at all", good_but({"-cipher", "ECDHE-RSA-CHACHA20-POLY1305"})},
      {"DTLS 1.0", old_version},
      {"no profile of SRTP", without_srtp},
      {"another profile of SRTP", good_but({"-use_srtp", "SRTP_AES128_CM_SHA1_32"})},
  };
  for (const auto& [what, arguments] : cases) {
    const Outcome outcome = call_with(arguments, 1.5);
    EXPECT_TRUE(outcome.heard) << what << "\n" << outcome.said;
    EXPECT_FALSE(outcome.connected) << what << "\n" << outcome.said;
    const std::size_t alert = outcome.said.find("alert");
    std::printf("%s: %s\n", what,
                alert != std::string::npos ? outcome.said.substr(alert, outcome.said.find('\n', alert) - alert).c_str()
                                           : "no answer");
  }
}

}  // namespace
}  // namespace farhand
