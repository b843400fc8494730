// What the serial frames and one loop of the MCU core cost on this computer.
#include <benchmark/benchmark.h>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/emulator.hpp"

namespace farhand {
namespace {

void encode_and_decode_a_frame(benchmark::State& state) {
  mcu::FrameDecoder decoder;
  std::uint8_t wire[mcu::kWireBytes], seq = 0;
  for (auto _ : state) {
    mcu::encode(mcu::make_command(mcu::Mode::kTrack, seq++, 0.1, -0.2, 0.3), wire);
    for (const std::uint8_t byte : wire) {
      if (decoder.push(byte)) benchmark::DoNotOptimize(mcu::unpack_command(decoder.payload()));
    }
  }
  if (decoder.crc_errors() + decoder.framing_errors() > 0) state.SkipWithError("frames were lost");
}
BENCHMARK(encode_and_decode_a_frame);

// As in the firmware: a command frame every second loop, telemetry on the other.
void mcu_step(benchmark::State& state) {
  mcu::OrthosisMcu core(mcu::make_mcu_params({}));
  std::uint8_t wire[mcu::kWireBytes], seq = 0;
  int loop = 0;
  for (auto _ : state) {
    if (loop % 2 == 0) {
      mcu::encode(mcu::make_command(loop < 4 ? mcu::Mode::kSafe : mcu::Mode::kTrack, seq++, 0.02, 0.1, 0.1), wire);
      for (const std::uint8_t byte : wire) core.receive(byte);
    }
    ++loop;
    benchmark::DoNotOptimize(core.step({loop & 63, (loop & 127) + 20, 25, false}));
    benchmark::DoNotOptimize(core.telemetry(wire));
  }
}
BENCHMARK(mcu_step);

void emulator_tick(benchmark::State& state) {
  OrthosisEmulator::Params params;
  params.world.environment.hand.emplace();
  OrthosisEmulator emulator(params);
  std::uint8_t wire[mcu::kWireBytes];
  for (auto _ : state) benchmark::DoNotOptimize(emulator.tick(wire));
}
BENCHMARK(emulator_tick);

}  // namespace
}  // namespace farhand
