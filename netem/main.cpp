// farhand-netem: a bad network between two stations on this machine, as a scene describes it.
#include <sys/prctl.h>

#include <cstdio>

#include "common/runtime/program.hpp"
#include "common/runtime/realtime.hpp"
#include "netem/link_params.hpp"
#include "netem/shim.hpp"

namespace farhand {
namespace {

struct Options {
  SceneChoice scene;
  std::string listen, forward, record;
  double duration_s = 0;
};

void print_row(const char* name, std::uint64_t packets, std::uint64_t lost, const DelayStatistics& delay) {
  const double share = packets > 0 ? 100.0 * static_cast<double>(lost) / static_cast<double>(packets) : 0;
  std::printf("  %-9s %9llu %8.2f %9.3f %8.3f %9.3f %9.3f %9.3f %9.3f\n", name,
              static_cast<unsigned long long>(packets), share, 1e3 * delay.mean_s(), 1e3 * delay.deviation_s(),
              1e3 * delay.quantile_s(0.5), 1e3 * delay.quantile_s(0.99), 1e3 * delay.min_s(), 1e3 * delay.max_s());
}

// "asked" is what the model drew for these very packets, so that any difference is the shim's and not chance.
void print_way(const char* name, const scene::Path& path, const ShimWay& way) {
  std::printf("%s: scene says %g ms, jitter %g ms (%s), loss %g %%\n", name, 1e3 * path.delay_s(),
              1e3 * path.jitter_s(), scene::Distribution_Name(path.distribution()).c_str(), 100 * path.loss());
  std::printf("            packets   lost %%   mean ms   std ms    p50 ms    p99 ms    min ms    max ms\n");
  print_row("asked", way.entered, way.lost, way.asked);
  print_row("achieved", way.entered, way.entered - way.achieved.count() - way.waiting.size(), way.achieved);
  std::printf(
      "  own lateness p50 %.3f, p99 %.3f, max %.3f ms; overflow %llu, not sendable %llu, too long %llu, dropped "
      "by the kernel %llu, still waiting "
      "%zu\n",
      1e3 * way.lateness.quantile_s(0.5), 1e3 * way.lateness.quantile_s(0.99), 1e3 * way.lateness.max_s(),
      static_cast<unsigned long long>(way.overflow), static_cast<unsigned long long>(way.unsent),
      static_cast<unsigned long long>(way.in->counters().oversized),
      static_cast<unsigned long long>(way.in->dropped_by_kernel()), way.waiting.size());
}

int run(const Options& options) {
  const LoadedScene loaded = options.scene.load();
  const scene::Scene& scene = loaded.scene;
  const UdpEndpoint listen = parse_endpoint(options.listen, EndpointUse::kListen),
                    forward = parse_endpoint(options.forward, EndpointUse::kPeer);
  if (listen == forward) throw std::invalid_argument("--forward " + options.forward + " is the address of --listen");
  Shim shim(listen, forward, link_params(scene.network().forward()), link_params(scene.network().backward()),
            scene.seed());
  const StopSignals stop;
  prctl(PR_SET_TIMERSLACK, 1);  // the kernel may otherwise round our waits up by 50 us
  const RealtimeReport realtime = enter_realtime(
      {.fifo_priority = static_cast<int>(scene.runtime().priority()), .lock_memory = scene.runtime().lock_memory()});
  for (const std::string& warning : realtime.warnings) std::fprintf(stderr, "farhand-netem: %s\n", warning.c_str());
  std::printf("listening %s\n", to_string(shim.local_endpoint()).c_str());
  std::fflush(stdout);

  const std::unique_ptr<Recorder> recorder = start_recorder(options.record, loaded, "netem");
  Shim::OnPacket on_packet;
  if (recorder) {
    on_packet = [&recorder](Nanoseconds entered_ns, const LinkSample& sample) { recorder->push(entered_ns, sample); };
  }
  shim.run(from_seconds(options.duration_s), stop, on_packet);
  finish_recorder(recorder.get(), {});
  print_way("forward (master to slave)", scene.network().forward(), shim.forward());
  print_way("backward (slave to master)", scene.network().backward(), shim.backward());
  return stop.signal() != 0 ? kExitStopped : kExitOk;
}

int main(int argc, char** argv) {
  Options options;
  Program program("farhand-netem",
                  "A bad network between farhand-master and farhand-slave, as the scene describes it.");
  Command command = program.command();
  command.text("--listen", options.listen, "ADDR:PORT that the slave dials; port 0 takes a free one", Needed::kYes);
  command.text("--forward", options.forward, "ADDR:PORT of the master", Needed::kYes);
  add_scene_option(command, options.scene);
  command.output("--record", options.record, "recording of every packet (MCAP)");
  command.number("--duration", options.duration_s, 0, 1e9, "seconds to run; 0 until stopped");
  return program.run(argc, argv, [&] { return run(options); });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
