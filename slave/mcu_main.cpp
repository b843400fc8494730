// farhand-mcu: the orthosis without hardware. MCU core and simulated orthosis behind a pseudo terminal, at the pace of
// 115200 baud.
//
// It counts MCU loops, not wall time: when the host wakes it more than two milliseconds late it moves its time base
// instead of catching up, so that a busy machine does not look like a dead cable. What the host sent meanwhile does not
// wait in a queue for it: it takes all of that and acts on the newest.
#include <poll.h>

#include <array>
#include <cstdio>

#include "common/device/pty.hpp"
#include "common/runtime/program.hpp"
#include "slave/emulator_params.hpp"
#include "slave/patient_buttons.hpp"
#include "slave/slow_host.hpp"

namespace farhand {
namespace {

struct Options {
  SceneChoice scene;
  std::string link, record;
};

class EmulatorLoop {
 public:
  EmulatorLoop(OrthosisOnSerial& orthosis, Pty& pty, PatientButtons& buttons, Recorder* recorder)
      : orthosis_(orthosis), pty_(pty), buttons_(buttons), recorder_(recorder) {}

  bool operator()(const TickTime& time) noexcept {
    if (time.stopping) return false;
    const bool late = time.missed > kCaughtUp;
    if (late) slow_host_.missed(time.missed);
    buttons_.tick();
    orthosis_.emulator().press_stop(buttons_.stop());
    orthosis_.emulator().press_release(buttons_.release());
    now_ += kMillisecond * static_cast<Nanoseconds>(late ? 1 : 1 + time.missed);

    hear(late);
    orthosis_.advance(now_);
    std::array<std::uint8_t, 256> bytes;
    std::size_t said = 0;
    while (said < bytes.size() && orthosis_.receive(now_, bytes[said])) ++said;
    pty_.write(std::span(bytes).first(said));
    record(time.deadline_ns);
    return true;
  }

  const SlowHost& slow_host() const noexcept { return slow_host_; }
  double virtual_s() const noexcept { return to_seconds(now_); }

 private:
  static constexpr std::uint64_t kCaughtUp = 2;  // ms
  static constexpr std::size_t kOnItsWay = 40;   // bytes; more were sent earlier than this loop looked
  static constexpr int kBursts = 64;             // more than the kernel keeps

  // All that waits.
  void hear(bool late) noexcept {
    std::array<std::uint8_t, 256> bytes;
    for (int burst = 0; burst < kBursts; ++burst) {
      const std::span heard(bytes.data(), pty_.read(bytes));
      if (late || orthosis_.waiting() + heard.size() > kOnItsWay) {
        orthosis_.catch_up(heard);
      } else {
        orthosis_.send(heard.data(), heard.size(), now_);
      }
      if (heard.size() < bytes.size()) return;
    }
  }

  void record(Nanoseconds t) noexcept {
    if (recorder_ == nullptr) return;
    const SeriesElasticWorld::Truth world = orthosis_.emulator().world().truth();
    McuSample sample;
    sample.true_x_rad = world.x;
    sample.true_v_rad_s = world.v;
    sample.true_f_nm = world.f;
    sample.motor_x_rad = world.motor_x;
    sample.spring_torque_nm = world.spring_torque;
    sample.torque_command_nm = mcu::to_nm(orthosis_.emulator().core().torque_command());
    sample.state = static_cast<int>(orthosis_.emulator().output().state);
    recorder_->push(t, sample);
  }

  OrthosisOnSerial& orthosis_;
  Pty& pty_;
  PatientButtons& buttons_;
  Recorder* recorder_;
  Nanoseconds now_ = 0;
  SlowHost slow_host_;
};

// The orthosis is switched on by its first byte from the host, so that the times of the scene count from there.
bool wait_for_host(const Pty& pty, const StopSignals& stop) {
  while (stop.signal() == 0) {
    pollfd ready{pty.native_handle(), POLLIN, 0};
    if (::poll(&ready, 1, 100) > 0 && (ready.revents & POLLIN) != 0) return true;
  }
  return false;
}

int run(const Options& options) {
  const LoadedScene loaded = options.scene.load();
  if (loaded.scene.slave().device() != scene::SERIES_ELASTIC) {
    throw std::invalid_argument("scene '" + loaded.name +
                                "' has no SERIES_ELASTIC slave, so there is no MCU to emulate");
  }
  OrthosisOnSerial orthosis(emulator_params(loaded.scene),
                            10 * 10.0 / 115200);  // ten bytes of ten bits, and no adapter
  Pty pty(options.link);
  const StopSignals stop;
  PatientButtons buttons;  // before anybody can know where to send its signals: unheard they would end the program
  std::printf("serial %s\n", options.link.c_str());
  std::fflush(stdout);
  if (!wait_for_host(pty, stop)) return kExitStopped;

  const std::unique_ptr<Recorder> recorder = start_recorder(options.record, loaded, "mcu");
  EmulatorLoop loop(orthosis, pty, buttons, recorder.get());
  const RunStats stats = farhand::run(loop_params(loaded.scene, kMillisecond, stop), loop);
  StationCounters counters;
  counters.ticks = stats.ticks;
  counters.overruns = stats.overruns;
  counters.missed_ticks = stats.missed;
  counters.serial_crc_errors = orthosis.emulator().core().decoder().crc_errors();
  finish_recorder(recorder.get(), counters);
  print_loop("mcu", stats);
  std::printf("farhand-mcu: %.3f s of MCU time; %llu host stalls, %llu ms in all, moved the time base\n",
              loop.virtual_s(), static_cast<unsigned long long>(loop.slow_host().stalls()),
              static_cast<unsigned long long>(loop.slow_host().ms()));
  return kExitStopped;  // it has no end of its own: only a signal switches it off
}

int main(int argc, char** argv) {
  Options options;
  Program program("farhand-mcu", "The emulated orthosis: MCU and hand behind a pseudo terminal.");
  Command command = program.command();
  add_scene_option(command, options.scene);
  command.text("--link", options.link, "path of the serial port to make (a symbolic link)", Needed::kYes);
  command.output("--record", options.record, "recording of the simulated orthosis (MCAP)");
  return program.run(argc, argv, [&] { return run(options); });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
