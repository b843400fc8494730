#include "common/secure/srtp_cipher.hpp"

#include <openssl/evp.h>
#include <srtp2/cipher.h>
#include <srtp2/crypto_types.h>
#include <srtp2/srtp.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

namespace farhand {
namespace {

constexpr int kKeyBytes = 16, kSaltBytes = 12, kTagBytes = 16;

// The public vector that libsrtp asks of every cipher: test case 2 of the specification of GCM (McGrew and Viega).
constexpr std::array<std::uint8_t, kKeyBytes + kSaltBytes> kTestKey{};
constexpr std::array<std::uint8_t, 16> kTestPlain{};
constexpr std::array<std::uint8_t, 32> kTestSealed{0x03, 0x88, 0xda, 0xce, 0x60, 0xb6, 0xa3, 0x92, 0xf3, 0x28, 0xc2,
                                                   0xb9, 0x71, 0xb2, 0xfe, 0x78, 0xab, 0x6e, 0x47, 0xd4, 0x2c, 0xec,
                                                   0x13, 0xbd, 0xf5, 0x3a, 0x67, 0xb2, 0x12, 0x57, 0xbd, 0xdf};
std::array<std::uint8_t, 12> test_iv{};
const srtp_cipher_test_case_t kTest{static_cast<int>(kTestKey.size()),
                                    kTestKey.data(),
                                    test_iv.data(),
                                    kTestPlain.size(),
                                    kTestPlain.data(),
                                    kTestSealed.size(),
                                    kTestSealed.data(),
                                    0,
                                    kTestKey.data(),
                                    kTagBytes,
                                    nullptr};

struct State {
  EVP_CIPHER_CTX* context;
  int tag_bytes;
};
State& state_of(void* state) { return *static_cast<State*>(state); }

srtp_err_status_t or_else(bool good, srtp_err_status_t otherwise) { return good ? srtp_err_status_ok : otherwise; }

srtp_err_status_t initialize(void* state, const std::uint8_t* key) {
  return or_else(EVP_CipherInit_ex(state_of(state).context, EVP_aes_128_gcm(), nullptr, key, nullptr, 1) == 1,
                 srtp_err_status_init_fail);
}

srtp_err_status_t set_iv(void* state, std::uint8_t* iv, srtp_cipher_direction_t direction) {
  const int encrypt = direction == srtp_direction_encrypt ? 1 : 0;
  return or_else(EVP_CipherInit_ex(state_of(state).context, nullptr, nullptr, nullptr, iv, encrypt) == 1,
                 srtp_err_status_init_fail);
}

srtp_err_status_t set_aad(void* state, const std::uint8_t* aad, std::uint32_t size) {
  int out = 0;
  return or_else(EVP_CipherUpdate(state_of(state).context, nullptr, &out, aad, static_cast<int>(size)) == 1,
                 srtp_err_status_algo_fail);
}

srtp_err_status_t encrypt(void* state, std::uint8_t* bytes, unsigned* size) {
  EVP_CIPHER_CTX* context = state_of(state).context;
  int out = 0;
  return or_else(EVP_CipherUpdate(context, bytes, &out, bytes, static_cast<int>(*size)) == 1 &&
                     EVP_CipherFinal_ex(context, bytes, &out) == 1,
                 srtp_err_status_cipher_fail);
}

srtp_err_status_t get_tag(void* state, std::uint8_t* tag, std::uint32_t* size) {
  const State& s = state_of(state);
  *size = static_cast<std::uint32_t>(s.tag_bytes);
  return or_else(EVP_CIPHER_CTX_ctrl(s.context, EVP_CTRL_AEAD_GET_TAG, s.tag_bytes, tag) == 1,
                 srtp_err_status_algo_fail);
}

// The tag stands behind what it seals.
srtp_err_status_t decrypt(void* state, std::uint8_t* bytes, unsigned* size) {
  const State& s = state_of(state);
  if (*size < static_cast<unsigned>(s.tag_bytes)) return srtp_err_status_bad_param;
  *size -= static_cast<unsigned>(s.tag_bytes);
  int out = 0;
  if (EVP_CIPHER_CTX_ctrl(s.context, EVP_CTRL_AEAD_SET_TAG, s.tag_bytes, bytes + *size) != 1) {
    return srtp_err_status_algo_fail;
  }
  return or_else(EVP_CipherUpdate(s.context, bytes, &out, bytes, static_cast<int>(*size)) == 1 &&
                     EVP_CipherFinal_ex(s.context, bytes + *size, &out) == 1,
                 srtp_err_status_auth_fail);
}

srtp_err_status_t allocate(srtp_cipher_pointer_t* cipher, int key_bytes, int tag_bytes);

srtp_err_status_t release(srtp_cipher_pointer_t cipher) {
  State* state = static_cast<State*>(cipher->state);
  EVP_CIPHER_CTX_free(state->context);  // wipes the key
  delete state;
  delete cipher;
  return srtp_err_status_ok;
}

const srtp_cipher_type_t kType{
    allocate, release,         initialize, set_aad, encrypt, decrypt, set_iv, get_tag, "AES-128 GCM through OpenSSL",
    &kTest,   SRTP_AES_GCM_128};

srtp_err_status_t allocate(srtp_cipher_pointer_t* cipher, int key_bytes, int tag_bytes) {
  if (key_bytes != kKeyBytes + kSaltBytes || tag_bytes <= 0 || tag_bytes > kTagBytes) return srtp_err_status_bad_param;
  EVP_CIPHER_CTX* context = EVP_CIPHER_CTX_new();
  if (context == nullptr) return srtp_err_status_alloc_fail;
  *cipher = new srtp_cipher_t{&kType, new State{context, tag_bytes}, key_bytes, SRTP_AES_GCM_128};
  return srtp_err_status_ok;
}

}  // namespace

void start_srtp() {
  static const bool started = [] {
    if (srtp_init() != srtp_err_status_ok) throw std::runtime_error("libsrtp does not start");
    const srtp_err_status_t status = srtp_replace_cipher_type(&kType, SRTP_AES_GCM_128);
    if (status != srtp_err_status_ok) {
      throw std::runtime_error("libsrtp does not take AES-128 GCM from OpenSSL (status " + std::to_string(status) +
                               ")");
    }
    return true;
  }();
  static_cast<void>(started);
}

}  // namespace farhand
