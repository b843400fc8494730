#include "tests/support/session_processes.hpp"

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>

#include "common/config/load.hpp"

namespace farhand {

const char* role_of(Program program) {
  constexpr std::array kRoles{"mcu", "master", "netem", "slave"};
  return kRoles[static_cast<std::size_t>(program)];
}

std::filesystem::path program_directory() { return FARHAND_PROGRAMS; }

std::string path_of(Program program) {
  return (program_directory() / (std::string("farhand-") + role_of(program))).string();
}

// The counter, if any, comes first: what it counts must pass through it before it reaches the other libraries.
std::vector<std::string> slave_environment(const std::vector<std::string>& more_preloads) {
  std::string preload;
  for (const std::string& library : more_preloads) preload += library + ":";
  preload += (program_directory() / "libfarhand_pty_modem.so").string();
  const char* asan = std::getenv("ASAN_OPTIONS");
  return {"LD_PRELOAD=" + preload,
          "ASAN_OPTIONS=" + (asan != nullptr ? std::string(asan) + ":" : std::string()) + "verify_asan_link_order=0"};
}

SessionProcesses::SessionProcesses(const std::filesystem::path& directory, const SessionOptions& options)
    : directory_(directory),
      options_(options),
      has_mcu_(load_scene(options.scene, options.sets).scene.slave().device() == scene::SERIES_ELASTIC) {
  for (const Program program : kPrograms)
    if (program != Program::kMcu || has_mcu_) start(program);
}

std::filesystem::path SessionProcesses::recording(Program program) const {
  const int starts = starts_[index(program)];
  const std::string number = starts > 1 ? "-" + std::to_string(starts) : "";
  return directory_ / (role_of(program) + number + ".mcap");
}

std::vector<std::string> SessionProcesses::command(Program program) const {
  const std::string line = (directory_ / "line").string();
  std::vector<std::string> all{path_of(program), "--scene", options_.scene, "--record", recording(program).string()};
  const auto add = [&](const std::vector<std::string>& more) { all.insert(all.end(), more.begin(), more.end()); };
  if (program == Program::kMcu) add({"--link", line});
  if (program == Program::kMaster) add({"--listen", master_address_, "--quiet"});
  if (program == Program::kNetem) add({"--listen", netem_address_, "--forward", master_address_});
  if (program == Program::kSlave) add({"--peer", netem_address_, "--quiet"});
  if (program == Program::kSlave && has_mcu_) add({"--serial", line});
  if (program == Program::kMaster || program == Program::kSlave) {
    add(options_.key.empty() ? std::vector<std::string>{"--insecure"}
                             : std::vector<std::string>{"--key", options_.key});
  }
  if (program == Program::kSlave) add(options_.slave_arguments);
  for (const std::string& one : options_.sets) add({"--set", one});
  return all;
}

namespace {

bool holds_a_terminal(pid_t pid) {
  std::error_code gone;  // the process, or a file that it closed meanwhile
  std::filesystem::directory_iterator file("/proc/" + std::to_string(pid) + "/fd", gone);
  for (; file != end(file); file.increment(gone)) {
    if (std::filesystem::read_symlink(*file, gone).string().starts_with("/dev/pts/")) return true;
  }
  return false;
}

}  // namespace

void SessionProcesses::start(Program program, const std::vector<std::string>& sets) {
  ++starts_[index(program)];
  std::vector<std::string> environment;
  if (program == Program::kSlave) {
    environment = slave_environment(options_.preloads);
  } else if (program == Program::kMaster && !options_.preloads.empty()) {
    std::string preload;
    for (const std::string& library : options_.preloads) preload += (preload.empty() ? "" : ":") + library;
    environment = {"LD_PRELOAD=" + preload};
  }
  if (program == Program::kSlave || program == Program::kMaster) {
    environment.insert(environment.end(), options_.station_environment.begin(), options_.station_environment.end());
  }
  auto& child = children_[index(program)];
  std::vector<std::string> line_of_it = command(program);
  for (const std::string& one : sets) line_of_it.insert(line_of_it.end(), {"--set", one});
  child = std::make_unique<ChildProcess>(line_of_it, environment);
  if (program == Program::kSlave) {
    // It listens nowhere; it is up once it holds its serial line, which somebody may pull out from then on.
    if (has_mcu_) comes_true([&] { return !child->running() || holds_a_terminal(child->pid()); });
    return;
  }
  const std::string line = child->read_line();
  const std::string expected = program == Program::kMcu ? "serial " : "listening ";
  if (!line.starts_with(expected)) {
    throw std::runtime_error(path_of(program) + " did not come up; it said '" + line + "' and " + child->err());
  }
  if (program == Program::kMaster) master_address_ = line.substr(expected.size());
  if (program == Program::kNetem) netem_address_ = line.substr(expected.size());
}

void SessionProcesses::kill(Program program) {
  // As the system removes the node of a device that is pulled out. A link that outlives its emulator would lead its
  // slave to whatever is given the number of the pseudo terminal next: the device of another session.
  if (program == Program::kMcu) std::filesystem::remove(directory_ / "line");
  (*this)[program].send_signal(SIGKILL);
  (*this)[program].wait();
}

Recorded SessionProcesses::recorded(Program program) const {
  std::filesystem::path file = recording(program);
  if (!std::filesystem::exists(file)) file += ".part";
  try {
    return read_recording(file);
  } catch (const std::runtime_error&) {  // nothing flushed yet
    return {};
  }
}

std::array<int, 4> SessionProcesses::stop() {
  std::array<int, 4> codes{};
  for (const Program program : {Program::kMaster, Program::kSlave, Program::kNetem, Program::kMcu}) {
    if (program == Program::kMcu && !has_mcu_) continue;
    (*this)[program].send_signal(SIGTERM);
    codes[index(program)] = (*this)[program].wait();
  }
  return codes;
}

bool comes_true(const std::function<bool()>& condition, double patience_s) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    usleep(100'000);
  }
  return condition();
}

}  // namespace farhand
