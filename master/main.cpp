// farhand-master: the therapist's station. Listens for the patient's box and runs the scene with the simulated
// therapist, or with a device behind a serial line.
#include <poll.h>

#include <cstdio>

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

int run(const Options& options) {
  const LoadedScene loaded = options.scene.load();
  const scene::Scene& scene = loaded.scene;
  const std::unique_ptr<Side> side = options.serial.empty() ? make_simulated_master(scene, draw_session())
                                                            : make_serial_master(scene, draw_session(), options.serial);
  UdpSocket socket = UdpSocket::listen(parse_endpoint(options.listen, EndpointUse::kListen));
  require_recordable(options.record);
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
  return run_station({loaded, *side, Role::kLeader, socket, operator_input, stop, options.record, options.quiet});
}

int main(int argc, char** argv) {
  Options options;
  Program program("farhand-master", "The therapist's station.");
  Command command = program.command();
  add_scene_option(command, options.scene);
  command.text("--listen", options.listen, "ADDR:PORT where the patient's box calls; port 0 takes a free one",
               Needed::kYes);
  command.text("--serial", options.serial,
               "serial port of the therapist's device; without it the therapist is simulated");
  command.text("--record", options.record, "recording of this side (MCAP)");
  command.number("--wait", options.wait_s, 0.1, 1e6, "seconds to wait for the patient's box");
  command.flag("--quiet", options.quiet, "no live status");
  return program.run(argc, argv, [&] { return run(options); });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
