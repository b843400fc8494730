// farhand-master: the therapist's station. Listens for the patient's box and runs the scene with the simulated
// therapist, or with a device behind a serial line.
#include <poll.h>

#include <cstdio>

#include "common/device/mcu_axis.hpp"
#include "common/device/serial_mcu_port.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/plant/master_world.hpp"
#include "common/runtime/program.hpp"
#include "common/runtime/station_loop.hpp"

namespace farhand {
namespace {

struct Options {
  SceneChoice scene;
  std::string listen, serial, record;
  double wait_s = 60;
  bool quiet = false;
};

enum class Waited { kPeer, kNobody, kStopped };

// The clock of the session starts when the patient's box is first heard. Any datagram will do: the loop judges what it
// says.
Waited wait_for_peer(const UdpSocket& socket, double wait_s, const StopSignals& stop) {
  const Nanoseconds end = monotonic_now() + from_seconds(wait_s);
  while (monotonic_now() < end) {
    if (stop.signal() != 0) return Waited::kStopped;
    pollfd ready{socket.native_handle(), POLLIN, 0};
    if (::poll(&ready, 1, 100) > 0) return Waited::kPeer;
  }
  return Waited::kNobody;
}

template <template <class> class SceneT, class A, class... AxisArgs>
int run(const Options& options, const LoadedScene& loaded, AxisArgs&&... axis_args) {
  const scene::Scene& scene = loaded.scene;
  Side<SceneT, A> side(master_station_params(scene, draw_session()), std::forward<AxisArgs>(axis_args)...);
  UdpSocket socket = UdpSocket::listen(parse_endpoint(options.listen, EndpointUse::kListen));
  const StopSignals stop;
  OperatorInput operator_input;
  std::printf("listening %s\n", to_string(socket.local_endpoint()).c_str());
  std::fflush(stdout);

  const Waited waited = wait_for_peer(socket, options.wait_s, stop);
  if (waited == Waited::kStopped) return kExitStopped;
  if (waited == Waited::kNobody) {
    std::fprintf(stderr, "farhand-master: no patient's box called within %g s (--wait sets this)\n", options.wait_s);
    return kExitFailed;
  }

  const std::unique_ptr<Recorder> recorder = start_recorder(options.record, loaded, "master");
  OperatorTimeline timeline(scene);
  RunStats stats;
  StationCounters counters;
  {
    LiveStatusPrinter status(options.quiet);
    StationLoop loop(side, Role::kLeader, scene.duration_s(),
                     {&socket, recorder.get(), &status, &operator_input, &timeline});
    stats = farhand::run(loop_params(scene, tick_of(scene), stop), loop);
    counters = loop.counters(stats);
  }
  finish_recorder(recorder.get(), counters);
  print_loop("farhand-master", stats);
  return exit_code(stats, side);
}

template <class A, class... AxisArgs>
int run_architecture(const Options& options, const LoadedScene& loaded, AxisArgs&&... axis_args) {
  const scene::Architecture architecture = loaded.scene.architecture();
  if (architecture == scene::FOUR_CHANNEL_CDOB)
    return run<FourChannelCdob, A>(options, loaded, std::forward<AxisArgs>(axis_args)...);
  if (architecture == scene::FOUR_CHANNEL_CDOB_SDCV) {
    return run<FourChannelCdobSdcv, A>(options, loaded, std::forward<AxisArgs>(axis_args)...);
  }
  return run<FourChannel, A>(options, loaded, std::forward<AxisArgs>(axis_args)...);
}

int main(int argc, char** argv) {
  Options options;
  CLI::App app("The therapist's station.", "farhand-master");
  add_scene_option(app, options.scene);
  add_set_options(app, options.scene);
  app.add_option("--listen", options.listen, "ADDR:PORT where the patient's box calls; port 0 takes a free one")
      ->required();
  app.add_option("--serial", options.serial,
                 "serial port of the therapist's device; without it the therapist is simulated");
  app.add_option("--record", options.record, "recording of this side (MCAP)");
  app.add_option("--wait", options.wait_s, "seconds to wait for the patient's box")->check(CLI::Range(0.1, 1e6));
  app.add_flag("--quiet", options.quiet, "no live status");
  return run_program(app, argc, argv, [&] {
    const LoadedScene loaded = options.scene.load();
    if (!options.serial.empty()) return run_architecture<McuAxis<SerialMcuPort>>(options, loaded, options.serial);
    return run_architecture<SimulatedAxis<MasterWorld>>(options, loaded, master_world_params(loaded.scene));
  });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
