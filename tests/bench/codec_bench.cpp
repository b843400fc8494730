// What Protobuf costs per packet, beside copying a plain struct with the same checksum.
#include <benchmark/benchmark.h>

#include <cstring>

#include "common/link/codec.hpp"

namespace farhand {
namespace {

template <int N>
Packet<N> sample() {
  Packet<N> packet{.session = 1,
                   .seq = 2,
                   .send_time_ns = 3,
                   .echo_session = 4,
                   .echo_seq = 5,
                   .echo_send_time_ns = 6,
                   .echo_dwell_ns = 7,
                   .expiry_ms = 8,
                   .state = StationState::kEngaged,
                   .limits = kLimitRate,
                   .motion = {}};
  packet.motion.x.setConstant(0.1);
  packet.motion.v.setConstant(0.2);
  packet.motion.f.setConstant(0.3);
  return packet;
}

template <int N>
void EncodeDecode(benchmark::State& state) {
  PacketCodec<N> codec;
  Packet<N> packet = sample<N>(), out;
  for (auto _ : state) {
    ++packet.seq;
    if (codec.decode(codec.encode(packet), out) != DecodeResult::kOk) state.SkipWithError("rejected");
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(EncodeDecode<1>);
BENCHMARK(EncodeDecode<2>);

template <int N>
void StructCopyWithChecksum(benchmark::State& state) {
  std::array<std::byte, sizeof(Packet<N>) + 4> buffer{};
  const std::span body = std::span(buffer).template first<sizeof(Packet<N>)>();
  Packet<N> packet = sample<N>(), out;
  for (auto _ : state) {
    ++packet.seq;
    std::memcpy(body.data(), static_cast<const void*>(&packet), body.size());
    const std::uint32_t sent = crc32c(body);
    std::memcpy(&buffer[body.size()], &sent, sizeof sent);
    benchmark::DoNotOptimize(buffer);
    std::uint32_t received = 0;
    std::memcpy(&received, &buffer[body.size()], sizeof received);
    if (crc32c(body) != received) state.SkipWithError("rejected");
    std::memcpy(static_cast<void*>(&out), body.data(), body.size());
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(StructCopyWithChecksum<1>);
BENCHMARK(StructCopyWithChecksum<2>);

void ChecksumAlone(benchmark::State& state) {
  std::array<std::byte, PacketCodec<1>::kSize - 6> bytes{};
  for (auto _ : state) {
    bytes[0] = static_cast<std::byte>(std::to_integer<unsigned>(bytes[0]) + 1);
    benchmark::DoNotOptimize(crc32c(bytes));
  }
}
BENCHMARK(ChecksumAlone);

}  // namespace
}  // namespace farhand
