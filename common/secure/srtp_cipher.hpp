// AES-128-GCM of OpenSSL for libsrtp. Debian builds libsrtp with NSS, which uses the heap and mutexes for every packet.
// libsrtp lets a program supply the cipher: framing, packet index and replay window stay libsrtp's, and the loop uses
// neither heap nor mutex.
#pragma once

namespace farhand {

// Starts libsrtp and installs the cipher, once per process and from any thread. Throws std::runtime_error if the cipher
// fails libsrtp's test vectors.
void start_srtp();

}  // namespace farhand
