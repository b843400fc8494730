// farhand-slave: the patient's box. Dials the therapist's station and drives the hand orthosis through its MCU. A lost
// peer never ends it: it holds and awaits its peer until its duration is over.
#include <chrono>
#include <cstdio>
#include <string_view>

#include "common/runtime/friction_keeper.hpp"
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
  std::string peer, serial, record, stop_input, friction;
  bool quiet = false;
};

std::unique_ptr<Side> make_side(const LoadedScene& loaded, const std::string& serial) {
  const bool elastic = loaded.scene.slave().device() == scene::SERIES_ELASTIC;
  if (elastic && serial.empty()) {
    throw std::invalid_argument("scene '" + loaded.name +
                                "' has a SERIES_ELASTIC slave: --serial PATH of its MCU is needed");
  }
  if (!elastic && !serial.empty()) {
    throw std::invalid_argument("scene '" + loaded.name + "' has a simulated DIRECT_DRIVE slave: --serial has no use");
  }
  return elastic ? make_serial_slave(loaded.scene, draw_session(), serial)
                 : make_simulated_slave(loaded.scene, draw_session());
}

std::int64_t utc_now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

int run(const Options& options) {
  const LoadedScene loaded = options.scene.load();
  StopInput stop_input(options.stop_input);
  FrictionKeeper friction(options.friction, utc_now_s());
  const std::unique_ptr<Side> side = make_side(loaded, options.serial);
  side->know(friction.known());
  const std::unique_ptr<PeerLink> link = open_link(options.link, options.peer, Role::kFollower, loaded.scene);
  const StopSignals stop;
  SuspendSignal suspend;
  OperatorInput operator_input;
  const OperatorNotices notices("farhand-slave", operator_input);
  std::fprintf(stderr, "farhand-slave: %s\n", friction.sentence().c_str());
  const int code = run_station({loaded, *side, Role::kFollower, *link, operator_input, stop, suspend, options.record,
                                options.quiet, &stop_input, &friction});
  if (stop_input.broken()) {
    std::fprintf(stderr, "farhand-slave: the patient's stop input '%s' has ended, and that stopped the hand\n",
                 options.stop_input.c_str());
  }
  const bool kept = friction.finish();
  return code == kExitOk && !kept ? kExitFailed : code;
}

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "pair") return run_pair("farhand-slave", argc - 1, argv + 1);
  Options options;
  Program program("farhand-slave", "The patient's box.");
  Command command = program.command();
  add_scene_option(command, options.scene);
  command.text("--peer", options.peer, "ADDR:PORT of the therapist's station", Needed::kYes);
  add_link_options(command, options.link);
  command.text("--serial", options.serial, "serial port of the orthosis MCU (scenes with a SERIES_ELASTIC slave)");
  command.text(
      "--stop-input", options.stop_input,
      "the patient's stop besides the MCU's: PATH of a pedal (/dev/input/event...), pipe or GPIO value file, or "
      "fd:N. Whatever comes from it stops at once, and so does its end");
  command.text(
      "--friction", options.friction,
      "the patient's file with the friction of the device: read at the start, and a sweep (`friction`) adds its "
      "result as soon as it is over");
  command.output("--record", options.record, "recording of this side (MCAP)");
  command.flag("--quiet", options.quiet, "no live status");
  command.epilogue(kKeysInShort);
  return program.run(argc, argv, [&] { return run(options); });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
