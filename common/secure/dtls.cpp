#include "common/secure/dtls.hpp"

#include <openssl/err.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <openssl/srtp.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "common/secure/datagram_bio.hpp"

namespace farhand {

struct DtlsContext::Impl {
  explicit Impl(const PairingKey& pairing) : key(pairing), identity(pairing.identity()) {}
  ~Impl() { SSL_CTX_free(ssl); }

  SSL_CTX* ssl = nullptr;
  PairingKey key;
  std::string identity;
  LinkEnd end = LinkEnd::kDialer;
  std::array<unsigned char, 32> cookie_secret{};
};

struct Dtls::Impl {
  explicit Impl(const DtlsContext::Impl& shared) : context(shared) {}
  ~Impl() { SSL_free(ssl); }

  const DtlsContext::Impl& context;
  DatagramBio datagrams;
  SSL* ssl = nullptr;
  UdpEndpoint from;
};

namespace {

constexpr const char* kSuite = "ECDHE-PSK-CHACHA20-POLY1305";
constexpr const char* kSrtpProfile = "SRTP_AEAD_AES_128_GCM";
constexpr std::string_view kExporter = "EXTRACTOR-dtls_srtp";

const DtlsContext::Impl& context_of(SSL* ssl) {
  return *static_cast<const DtlsContext::Impl*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)));
}

unsigned give_key(const DtlsContext::Impl& context, unsigned char* key, unsigned room) {
  const auto& bytes = context.key.bytes();
  if (room < bytes.size()) return 0;
  std::copy(bytes.begin(), bytes.end(), key);
  return static_cast<unsigned>(bytes.size());
}

unsigned dialer_key(SSL* ssl, const char*, char* identity, unsigned identity_room, unsigned char* key, unsigned room) {
  const DtlsContext::Impl& context = context_of(ssl);
  if (identity_room <= context.identity.size()) return 0;
  std::memcpy(identity, context.identity.c_str(), context.identity.size() + 1);
  return give_key(context, key, room);
}

unsigned listener_key(SSL* ssl, const char* identity, unsigned char* key, unsigned room) {
  const DtlsContext::Impl& context = context_of(ssl);
  if (identity == nullptr || context.identity != identity) return 0;  // unknown_psk_identity
  return give_key(context, key, room);
}

// The cookie proves that the sender can be reached where it says it is.
int make_cookie(SSL* ssl, unsigned char* cookie, unsigned* size) {
  const DtlsContext::Impl& context = context_of(ssl);
  const UdpEndpoint& from = *static_cast<const UdpEndpoint*>(SSL_get_app_data(ssl));
  std::array<unsigned char, 19> sender{};
  std::copy(from.address.begin(), from.address.end(), sender.begin());
  sender[16] = static_cast<unsigned char>(from.port >> 8);
  sender[17] = static_cast<unsigned char>(from.port & 0xFF);
  sender[18] = from.v6 ? 1 : 0;
  return HMAC(EVP_sha256(), context.cookie_secret.data(), static_cast<int>(context.cookie_secret.size()), sender.data(),
              sender.size(), cookie, size) != nullptr
             ? 1
             : 0;
}

int check_cookie(SSL* ssl, const unsigned char* cookie, unsigned size) {
  std::array<unsigned char, 32> expected{};
  unsigned expected_size = 0;
  return make_cookie(ssl, expected.data(), &expected_size) == 1 && size == expected_size &&
                 CRYPTO_memcmp(cookie, expected.data(), size) == 0
             ? 1
             : 0;
}

// Without use_srtp the handshake would succeed and agree on no profile: better it ends here.
int require_srtp(SSL* ssl, int* alert, void*) {
  const unsigned char* body = nullptr;
  std::size_t size = 0;
  if (SSL_client_hello_get0_ext(ssl, TLSEXT_TYPE_use_srtp, &body, &size) == 1) return SSL_CLIENT_HELLO_SUCCESS;
  *alert = SSL_AD_HANDSHAKE_FAILURE;
  return SSL_CLIENT_HELLO_ERROR;
}

// OpenSSL's timer reads the wall clock. Ours is an argument (Association), so this one never runs out: 4000 s.
unsigned never(SSL*, unsigned) { return 4'000'000'000u; }

void require(bool good, const char* what) {
  if (!good) throw std::runtime_error(std::string("this OpenSSL does not do ") + what);
}

std::string last_error() {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = code != 0 ? ERR_reason_error_string(code) : nullptr;
  return reason != nullptr ? reason : "no reason given";
}

}  // namespace

DtlsContext::DtlsContext(LinkEnd end, const PairingKey& key) : impl_(std::make_unique<Impl>(key)) {
  impl_->end = end;
  SSL_CTX* ssl = SSL_CTX_new(end == LinkEnd::kDialer ? DTLS_client_method() : DTLS_server_method());
  require(ssl != nullptr, "DTLS");
  impl_->ssl = ssl;
  SSL_CTX_set_app_data(ssl, impl_.get());
  require(SSL_CTX_set_min_proto_version(ssl, DTLS1_2_VERSION) == 1 &&
              SSL_CTX_set_max_proto_version(ssl, DTLS1_2_VERSION) == 1,
          "DTLS 1.2");
  require(SSL_CTX_set_cipher_list(ssl, kSuite) == 1, kSuite);
  require(SSL_CTX_set_tlsext_use_srtp(ssl, kSrtpProfile) == 0, kSrtpProfile);
  // No resumption: every session has fresh keys, and what was recorded stays secret after a key is lost.
  SSL_CTX_set_session_cache_mode(ssl, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(ssl, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_TICKET | SSL_OP_NO_COMPRESSION | SSL_OP_NO_QUERY_MTU |
                               SSL_OP_COOKIE_EXCHANGE);
  if (end == LinkEnd::kDialer) {
    SSL_CTX_set_psk_client_callback(ssl, dialer_key);
  } else {
    require(RAND_bytes(impl_->cookie_secret.data(), static_cast<int>(impl_->cookie_secret.size())) == 1,
            "random numbers");
    SSL_CTX_set_psk_server_callback(ssl, listener_key);
    SSL_CTX_set_cookie_generate_cb(ssl, make_cookie);
    SSL_CTX_set_cookie_verify_cb(ssl, check_cookie);
    SSL_CTX_set_client_hello_cb(ssl, require_srtp, nullptr);
  }
}

DtlsContext::~DtlsContext() = default;

Dtls::Dtls(const DtlsContext& context) : impl_(std::make_unique<Impl>(context.impl())) {
  impl_->ssl = SSL_new(context.impl().ssl);
  require(impl_->ssl != nullptr, "another connection");
  SSL_set_app_data(impl_->ssl, &impl_->from);
  BIO_up_ref(impl_->datagrams.get());
  SSL_set0_rbio(impl_->ssl, impl_->datagrams.get());
  BIO_up_ref(impl_->datagrams.get());
  SSL_set0_wbio(impl_->ssl, impl_->datagrams.get());
  SSL_set_mtu(impl_->ssl, DatagramBio::kLargest);
  DTLS_set_timer_cb(impl_->ssl, never);
  if (context.impl().end == LinkEnd::kDialer) {
    SSL_set_connect_state(impl_->ssl);
  } else {
    SSL_set_accept_state(impl_->ssl);
  }
}

Dtls::~Dtls() = default;

bool Dtls::listen(std::span<const std::byte> datagram, const UdpEndpoint& from) {
  ERR_clear_error();
  impl_->from = from;
  impl_->datagrams.deliver(datagram);
  BIO_ADDR* unused = BIO_ADDR_new();
  const bool verified = DTLSv1_listen(impl_->ssl, unused) == 1;
  BIO_ADDR_free(unused);
  return verified;
}

Dtls::State Dtls::step(std::span<const std::byte> datagram) {
  if (!datagram.empty()) impl_->datagrams.deliver(datagram);
  if (state_ != State::kHandshake) return state_;
  ERR_clear_error();
  const int result = SSL_do_handshake(impl_->ssl);
  if (result == 1) return check_agreement();
  return SSL_get_error(impl_->ssl, result) == SSL_ERROR_WANT_READ ? state_ : fail();
}

Dtls::State Dtls::fail() {
  why_ = last_error();
  return state_ = State::kFailed;
}

// What the handshake must have agreed on. All of it follows from what is offered; it is looked at again because
// everything else rests on it.
Dtls::State Dtls::check_agreement() {
  const SRTP_PROTECTION_PROFILE* profile = SSL_get_selected_srtp_profile(impl_->ssl);
  const char* suite = SSL_get_cipher_name(impl_->ssl);
  if (profile == nullptr || std::string_view(profile->name) != kSrtpProfile) {
    why_ = "no SRTP profile was agreed on";
  } else if (SSL_version(impl_->ssl) != DTLS1_2_VERSION || std::string_view(suite) != kSuite) {
    why_ = std::string("agreed on ") + SSL_get_version(impl_->ssl) + " with " + suite;
  } else if (SSL_get_extms_support(impl_->ssl) != 1) {
    why_ = "the peer has no extended master secret";
  } else {
    return state_ = State::kConnected;
  }
  return state_ = State::kFailed;
}

void Dtls::send(std::span<const std::byte> message) {
  ERR_clear_error();
  const int result = SSL_write(impl_->ssl, message.data(), static_cast<int>(message.size()));
  if (result <= 0) fail();
}

std::optional<Bytes> Dtls::receive() {
  if (state_ != State::kConnected) return std::nullopt;
  ERR_clear_error();
  Bytes message(DatagramBio::kLargest);
  const int size = SSL_read(impl_->ssl, message.data(), static_cast<int>(message.size()));
  if (size > 0) {
    message.resize(static_cast<std::size_t>(size));
    return message;
  }
  if (SSL_get_error(impl_->ssl, size) != SSL_ERROR_WANT_READ) fail();
  return std::nullopt;
}

SrtpKeys Dtls::srtp_keys() const {
  SrtpKeys keys;
  if (SSL_export_keying_material(impl_->ssl, keys.bytes.data(), keys.bytes.size(), kExporter.data(), kExporter.size(),
                                 nullptr, 0, 0) != 1) {
    throw std::runtime_error("OpenSSL exports no keys: " + last_error());
  }
  return keys;
}

std::vector<Bytes> Dtls::take_written() { return impl_->datagrams.take_written(); }

}  // namespace farhand
