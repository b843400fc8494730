// The serial line from the MCU, as the PC hears it: what passes is a frame of eight bytes with a CRC and nothing else,
// and no frame makes the axis give out a reading that is old, not finite or of a device in a fault.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/device/mcu_axis.hpp"
#include "tests/fuzz/targets.hpp"

namespace farhand::fuzz {
namespace {

using Wire = std::array<std::uint8_t, mcu::kWireBytes>;

// Bit by bit, without the table of the frames.
std::uint16_t plain_crc16(Bytes bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<unsigned>(byte) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1 ^ (crc & 0x8000 ? 0x3D65u : 0u)) & 0xFFFF;
  }
  return static_cast<std::uint16_t>(crc);
}

class FedPort {
 public:
  explicit FedPort(std::vector<std::uint8_t>& line) : line_(line) {}
  std::size_t read(std::span<std::uint8_t> to, double) noexcept {
    const std::size_t size = std::min(to.size(), line_.size());
    std::copy_n(line_.begin(), size, to.begin());
    line_.erase(line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(size));
    return size;
  }
  bool write(std::span<const std::uint8_t> bytes, double) noexcept {
    return bytes.size() == mcu::kWireBytes && bytes.back() == 0 && std::count(bytes.begin(), bytes.end(), 0) == 1;
  }
  void drop_unsent(double) noexcept {}
  bool lost() noexcept { return false; }

 private:
  std::vector<std::uint8_t>& line_;
};

// The line by itself: every frame that passes is checked against the bytes that made it.
bool check_frames(Bytes line) {
  mcu::FrameDecoder decoder;
  std::vector<std::uint8_t> since_zero;
  unsigned passed = 0, refused = 0;
  for (const std::uint8_t byte : line) {
    const bool ended = byte == 0 && !since_zero.empty();
    const bool valid = decoder.push(byte);
    if (byte != 0) since_zero.push_back(byte);
    require(!valid || ended, "a frame ends with 0x00");
    if (!ended) continue;
    if (valid) {
      ++passed;
      const std::uint8_t* payload = decoder.payload();
      require(plain_crc16({payload, mcu::kDecodedBytes}) == 0, "an accepted frame has its CRC");
      Wire again;
      mcu::encode_frame(payload, again.data());
      require(since_zero.size() == 9 && std::equal(since_zero.begin(), since_zero.end(), again.begin()),
              "what decodes encodes to its bytes");
      std::array<std::uint8_t, mcu::kPayloadBytes> same{};
      mcu::pack(mcu::unpack_telemetry(payload), same.data());
      require(std::equal(same.begin(), same.end(), payload), "telemetry says all that its frame holds");
      mcu::pack(mcu::unpack_command(payload), same.data());
      require(std::equal(same.begin(), same.end(), payload), "a command says all that its frame holds");
    } else {
      ++refused;
    }
    since_zero.clear();
  }
  require(((decoder.crc_errors() + decoder.framing_errors() - refused) & 0xFFFF) == 0, "what is refused is counted");
  return passed > 0;
}

}  // namespace

bool serial_host(Bytes input) {
  bool taken = check_frames(input);

  // Ticks of the axis: a byte of what happens, then raw bytes, or six for a frame that is mended.
  std::vector<std::uint8_t> line;
  McuAxis<FedPort> axis(line);
  Cursor cursor(input);
  double now = 0, heard = -1;
  bool tracking = false;
  while (!cursor.empty()) {
    const std::uint8_t what = cursor.byte();
    now += (what & 15) * 1e-3;
    if ((what & 0x80) != 0) {
      std::array<std::uint8_t, mcu::kPayloadBytes> payload{};
      const Bytes given = cursor.take(payload.size());
      std::copy(given.begin(), given.end(), payload.begin());
      Wire wire;
      mcu::encode_frame(payload.data(), wire.data());
      line.insert(line.end(), wire.begin(), wire.end());
    } else {
      const Bytes raw = cursor.take(what >> 4 & 7);
      line.insert(line.end(), raw.begin(), raw.end());
    }
    const auto frames = axis.counters().received;
    const auto sensed = axis.read(now);
    if (axis.counters().received != frames) heard = now;
    require(sensed.finite(), "readings are finite");
    require(std::abs(sensed.x[0]) <= 3.2768 && std::abs(sensed.f[0]) <= 3.2768, "readings stay within their scale");
    if (sensed.valid) {
      require(heard >= 0 && now - heard <= 0.0501, "a reading is valid for 50 ms at most");
      require(axis.state() != mcu::State::kFault, "a device in a fault gives no valid reading");
    }
    require(std::isfinite(axis.slow().spring_torque_nm()) && std::abs(axis.slow().motor_angle_rad()) <= 3.2768,
            "slow values are finite");
    tracking = (what & 0x40) != 0;
    ReferenceIo<1>::Command command{.track = tracking, .reference = {}};
    const std::int32_t bits = what % 8 == 7 ? cursor.word() : 0;
    float reference = 0;  // any number there is, NaN too
    std::memcpy(&reference, &bits, sizeof reference);
    command.reference.x.setConstant(static_cast<double>(reference));
    axis.write(command, now);
    require(axis.counters().dropped == 0, "what is sent is a frame");
  }
  return taken || axis.counters().received > 0;
}

}  // namespace farhand::fuzz
