// A program of ours as a child of a test: lines into its standard input, lines out of its standard output, its exit.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace farhand {

class ChildProcess {
 public:
  // program and arguments; environment: "NAME=value" on top of ours. A test that fails to start it throws
  // std::runtime_error.
  explicit ChildProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment = {});
  ~ChildProcess();  // kills it if it still runs
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  void say(const std::string& text) const;  // to its standard input
  void end_input();
  void send_signal(int signal) const;
  bool running();

  // The next line of its standard output without the newline; empty when it ended, or said nothing for a minute.
  std::string read_line();
  // Waits for the end: the exit code, or 128 + the signal that killed it.
  int wait();
  // Everything it wrote; complete after wait().
  const std::string& out() const { return out_; }
  std::string err() const;

 private:
  bool read_more();

  pid_t pid_ = -1;
  int in_ = -1, out_pipe_ = -1, err_file_ = -1;
  int status_ = -1;
  bool ended_ = false;
  std::string out_;
  std::size_t read_ = 0;
};

}  // namespace farhand
