// AES-128-GCM for libsrtp through OpenSSL. Debian builds libsrtp on NSS, which takes the heap and mutexes for every
// packet; libsrtp lets a program bring the cipher, so framing, packet index and replay window stay libsrtp's and the
// loop stays free of both.
#pragma once

namespace farhand {

// Starts libsrtp and puts the cipher in place, once per process and from any thread. Throws std::runtime_error when the
// cipher does not pass libsrtp's test vectors.
void start_srtp();

}  // namespace farhand
