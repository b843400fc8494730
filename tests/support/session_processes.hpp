// The real programs of one session as children of a test: emulated MCU, master, netem and slave on loopback and a
// pseudo terminal, each with a recording. Any of them may be killed and started again in its old place. A scene with a
// DIRECT_DRIVE slave has no MCU, and three programs.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/record/session_file.hpp"
#include "tests/support/child_process.hpp"

namespace farhand {

enum class Program { kMcu, kMaster, kNetem, kSlave };
inline constexpr std::array kPrograms{Program::kMcu, Program::kMaster, Program::kNetem, Program::kSlave};

const char* role_of(Program program);       // as in its recording
std::string path_of(Program program);       // of the executable
std::filesystem::path program_directory();  // with the preload libraries beside the programs
std::vector<std::string> slave_environment(const std::vector<std::string>& more_preloads = {});

struct SessionOptions {
  std::string scene;
  std::vector<std::string> sets;                  // the same for all four
  std::vector<std::string> preloads;              // further libraries under both stations
  std::vector<std::string> station_environment;   // "NAME=value" for both stations
  std::string key = {};                           // file of the pairing key; empty: --insecure
  std::vector<std::string> slave_arguments = {};  // further ones
};

class SessionProcesses {
 public:
  // Starts all of them, the slave last; records into `directory`. Throws std::runtime_error with what a program said
  // when one does not come up.
  SessionProcesses(const std::filesystem::path& directory, const SessionOptions& options);

  ChildProcess& operator[](Program program) { return *children_[index(program)]; }
  void engage() { (*this)[Program::kMaster].say("engage\n"); }

  // In the place of one that has ended: same address, same path, a recording of its own. sets: beside those of the
  // session, for this start.
  void start(Program program, const std::vector<std::string>& sets = {});
  void kill(Program program);  // SIGKILL, and waits for its end; with the MCU goes its device's path

  // What the newest start of the program has recorded so far. Empty series if there is nothing readable yet.
  Recorded recorded(Program program) const;
  std::filesystem::path recording(Program program) const;  // its name when complete

  // SIGTERM to master, slave, netem and MCU in this order, each after the end of the one before, so that nobody loses
  // what it stands on. The exit codes in the order of kPrograms; 0 for an MCU that is not there.
  std::array<int, 4> stop();

 private:
  static std::size_t index(Program program) { return static_cast<std::size_t>(program); }
  std::vector<std::string> command(Program program) const;

  std::filesystem::path directory_;
  SessionOptions options_;
  bool has_mcu_;
  std::string master_address_ = "127.0.0.1:0", netem_address_ = "127.0.0.1:0";
  std::array<int, 4> starts_{};
  std::array<std::unique_ptr<ChildProcess>, 4> children_;
};

// Looks again every 100 ms until the condition holds. False after a minute: a test fails then, it is no deadline for
// the programs.
bool comes_true(const std::function<bool()>& condition, double patience_s = 60);

}  // namespace farhand
