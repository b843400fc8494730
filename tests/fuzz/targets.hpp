// What is fed with hostile input: each target takes any bytes and says whether anything in them was taken for valid.
// It does not only survive; what it promises about every input is required, by an implementation of its own where
// there is one. libFuzzer runs a target for hours (libfuzzer.cpp), ctest its corpus and mutations of it (replay.cpp).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace farhand::fuzz {

using Bytes = std::span<const std::uint8_t>;

bool packet(Bytes input);       // datagrams of the peer: codec and receiver
bool handshake(Bytes input);    // greetings; datagrams of strangers; someone on the path of a handshake
bool serial_host(Bytes input);  // the line from the MCU, as the PC hears it
bool serial_mcu(Bytes input);   // the line to the MCU, sensors and switches
bool config(Bytes input);       // a scene and what --set says
bool recording(Bytes input);    // a recording, finished or torn
bool pairing_key(Bytes input);  // a file that should hold a key
bool command(Bytes input);      // addresses on the command line; what an operator's pipe says

struct Target {
  const char* name;
  bool (*run)(Bytes input);
};
inline constexpr Target kTargets[] = {
    {"packet", packet}, {"handshake", handshake}, {"serial_host", serial_host}, {"serial_mcu", serial_mcu},
    {"config", config}, {"recording", recording}, {"pairing_key", pairing_key}, {"command", command}};

// No std::exception: a target that expects those must not take this for one.
struct Broken {
  const char* promise;
};
inline void require(bool kept, const char* promise) {
  if (!kept) throw Broken{promise};
}

// Reads an input off from its front. What is not there is zero, or short.
class Cursor {
 public:
  explicit Cursor(Bytes bytes) : rest_(bytes) {}

  bool empty() const { return rest_.empty(); }
  Bytes take(std::size_t size) {
    const Bytes taken = rest_.first(std::min(size, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::uint8_t byte() {
    const Bytes taken = take(1);
    return taken.empty() ? std::uint8_t{0} : taken[0];
  }
  // Little endian.
  std::int32_t word() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 8) value |= static_cast<std::uint32_t>(byte()) << shift;
    return static_cast<std::int32_t>(value);
  }

 private:
  Bytes rest_;
};

}  // namespace farhand::fuzz
