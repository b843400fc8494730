// farhand-slave: the patient's box. Dials the therapist's station and drives the hand orthosis through its MCU. A lost
// peer never ends it: it holds and awaits its peer until its duration is over.
#include <cstdio>

#include "common/device/mcu_axis.hpp"
#include "common/device/serial_mcu_port.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/plant/direct_slave_world.hpp"
#include "common/runtime/program.hpp"
#include "common/runtime/station_loop.hpp"

namespace farhand {
namespace {

struct Options {
  SceneChoice scene;
  std::string peer, serial, record;
  bool quiet = false;
};

template <class A, class... AxisArgs>
int run(const Options& options, const LoadedScene& loaded, AxisArgs&&... axis_args) {
  const scene::Scene& scene = loaded.scene;
  Side<FourChannel, A> side(slave_station_params(scene, draw_session()), std::forward<AxisArgs>(axis_args)...);
  UdpSocket socket = UdpSocket::dial(parse_endpoint(options.peer, EndpointUse::kPeer));
  const StopSignals stop;
  OperatorInput operator_input;
  const std::unique_ptr<Recorder> recorder = start_recorder(options.record, loaded, "slave");
  RunStats stats;
  StationCounters counters;
  {
    LiveStatusPrinter status(options.quiet);
    StationLoop loop(side, Role::kFollower, scene.duration_s(),
                     {&socket, recorder.get(), &status, &operator_input, nullptr});
    stats = farhand::run(loop_params(scene, tick_of(scene), stop), loop);
    counters = loop.counters(stats);
  }
  finish_recorder(recorder.get(), counters);
  print_loop("farhand-slave", stats);
  return exit_code(stats, side);
}

int main(int argc, char** argv) {
  Options options;
  CLI::App app("The patient's box.", "farhand-slave");
  add_scene_option(app, options.scene);
  add_set_options(app, options.scene);
  app.add_option("--peer", options.peer, "ADDR:PORT of the therapist's station")->required();
  app.add_option("--serial", options.serial, "serial port of the orthosis MCU (scenes with a SERIES_ELASTIC slave)");
  app.add_option("--record", options.record, "recording of this side (MCAP)");
  app.add_flag("--quiet", options.quiet, "no live status");
  return run_program(app, argc, argv, [&] {
    const LoadedScene loaded = options.scene.load();
    const bool elastic = loaded.scene.slave().device() == scene::SERIES_ELASTIC;
    if (elastic && options.serial.empty()) {
      throw std::invalid_argument("scene '" + loaded.name +
                                  "' has a SERIES_ELASTIC slave: --serial PATH of its MCU is needed");
    }
    if (!elastic && !options.serial.empty()) {
      throw std::invalid_argument("scene '" + loaded.name +
                                  "' has a simulated DIRECT_DRIVE slave: --serial has no use");
    }
    if (elastic) return run<McuAxis<SerialMcuPort>>(options, loaded, options.serial);
    return run<SimulatedAxis<DirectSlaveWorld>>(options, loaded, direct_slave_world_params(loaded.scene));
  });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
