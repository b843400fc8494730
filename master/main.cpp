// farhand-master: the therapist's station. Listens for the patient's box and runs the scene with the simulated
// therapist, or with a device behind a serial line.
#include <poll.h>

#include <cstdio>
#include <string_view>
#include <utility>

#include "common/runtime/link_options.hpp"
#include "common/runtime/operator_notices.hpp"
#include "common/runtime/operator_words.hpp"
#include "common/runtime/program.hpp"
#include "common/runtime/station_loop.hpp"

namespace farhand {
namespace {

struct Options {
  SceneChoice scene;
  LinkOptions link;
  std::string listen, serial, record;
  double wait_s = 60;
  bool quiet = false;
};

enum class Waited { kPeer, kNobody, kRefused, kStopped };

// The clock of the session starts when the patient's box is first heard.
Waited wait_for_peer(PeerLink& link, double wait_s, const StopSignals& stop, SuspendSignal& suspend,
                     OperatorInput& operator_input) {
  constexpr int kLook_ms = 5;
  constexpr Nanoseconds kLastWord = kSecond;  // in which a refused peer hears why
  Nanoseconds end = monotonic_now() + from_seconds(wait_s);
  bool refused = false;
  while (monotonic_now() < end) {
    if (stop.signal() != 0) return refused ? Waited::kRefused : Waited::kStopped;
    operator_input.wait(monotonic_now());
    if (suspend.asked()) suspend.suspend();  // nothing moves yet
    if (link.called(monotonic_now())) return Waited::kPeer;
    if (link.refused() && !std::exchange(refused, true)) end = monotonic_now() + kLastWord;
    pollfd ready{link.socket().native_handle(), POLLIN, 0};
    ::poll(&ready, 1, kLook_ms);
  }
  return refused ? Waited::kRefused : Waited::kNobody;
}

int run(const Options& options) {
  const LoadedScene loaded = options.scene.load();
  const scene::Scene& scene = loaded.scene;
  const std::unique_ptr<Side> side = options.serial.empty() ? make_simulated_master(scene, draw_session())
                                                            : make_serial_master(scene, draw_session(), options.serial);
  const std::unique_ptr<PeerLink> link = open_link(options.link, options.listen, Role::kLeader, scene);
  const StopSignals stop;
  SuspendSignal suspend;
  OperatorInput operator_input;
  const OperatorNotices notices("farhand-master", operator_input);
  std::printf("listening %s\n", to_string(link->socket().local_endpoint()).c_str());
  std::fflush(stdout);

  const Waited waited = wait_for_peer(*link, options.wait_s, stop, suspend, operator_input);
  if (waited == Waited::kStopped) return kExitStopped;
  if (waited == Waited::kRefused) return kExitUsage;
  if (waited == Waited::kNobody) {
    std::fprintf(stderr, "farhand-master: no patient's box called within %g s (--wait sets this)\n", options.wait_s);
    return kExitFailed;
  }
  return run_station(
      {loaded, *side, Role::kLeader, *link, operator_input, stop, suspend, options.record, options.quiet});
}

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "pair") return run_pair("farhand-master", argc - 1, argv + 1);
  Options options;
  Program program("farhand-master", "The therapist's station.");
  Command command = program.command();
  add_scene_option(command, options.scene);
  command.text("--listen", options.listen, "ADDR:PORT where the patient's box calls; port 0 takes a free one",
               Needed::kYes);
  add_link_options(command, options.link);
  command.text("--serial", options.serial,
               "serial port of the therapist's device; without it the therapist is simulated");
  command.output("--record", options.record, "recording of this side (MCAP)");
  command.number("--wait", options.wait_s, 0.1, 1e6, "seconds to wait for the patient's box");
  command.flag("--quiet", options.quiet, "no live status");
  command.epilogue(kKeysInShort);
  return program.run(argc, argv, [&] { return run(options); });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
