// The command line of a program, or of one of its subcommands. Options are bound to variables before parsing; the
// parser itself is compiled once, behind this face.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace farhand {

struct NamedFiles;  // the inputs and outputs of a program's commands

enum class Needed : std::uint8_t { kNo, kYes };

// A handle: copies mean the same command. Names of options begin with --, names of positional arguments are in
// capitals.
class Command {
 public:
  Command subcommand(const char* name, const char* purpose);
  void require_subcommand();

  void text(const char* name, std::string& value, const char* meaning, Needed needed = Needed::kNo);
  // A file that is read. No output may have the same name.
  void input(const char* name, std::string& value, const char* meaning, Needed needed = Needed::kNo);
  // A file that is made, or a directory for files. It is refused before anything runs if it cannot be made
  // (require_output in common/files/output.hpp), is an input of the same command, or has the name of another output.
  // The command itself handles "-".
  void output(const char* name, std::string& value, const char* meaning);
  void output_directory(const char* name, std::string& value, const char* meaning);
  // Positional: one or more values. As an option: one value each time that it is written.
  void texts(const char* name, std::vector<std::string>& values, const char* meaning, Needed needed = Needed::kNo);
  // Both ends of a range are allowed; NaN is outside every range.
  void number(const char* name, double& value, double min, double max, const char* meaning);
  void count(const char* name, int& value, int min, int max, const char* meaning);
  void seed(const char* name, std::optional<std::uint64_t>& value, const char* meaning);
  // "!--no-thing" clears the value.
  void flag(const char* name, bool& value, const char* meaning);

  // This option, declared before, is refused together with any other option of its command.
  void alone(const char* name);

  // Text below the options in --help.
  void epilogue(const std::string& text);

  // After parsing: true if this subcommand was given.
  bool given() const;

 private:
  friend class Program;
  Command(CLI::App* app, NamedFiles* files) : app_(app), files_(files) {}
  CLI::App* app_;
  NamedFiles* files_;
};

inline constexpr int kExitOk = 0;             // also when the verdict is degraded
inline constexpr int kExitFailed = 1;         // failed while running
inline constexpr int kExitUsage = 2;          // arguments, scene, files, ports: before anything moved
inline constexpr int kExitVerdictFailed = 3;  // ran to its end, and the verdict is failed
inline constexpr int kExitStopped = 130;      // came to rest after a signal

class Program {
 public:
  Program(const std::string& name, const std::string& purpose);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  Command command() { return Command(app_, files_.get()); }
  // Parses, runs the body, and turns its exceptions into a sentence and an exit code. A body throws only before its
  // loop. From here on a file that may not grow, or a pipe that nobody reads, is an error of one write and does not end
  // the program.
  int run(int argc, char** argv, const std::function<int()>& body);

 private:
  CLI::App* app_;
  std::unique_ptr<NamedFiles> files_;
};

}  // namespace farhand
