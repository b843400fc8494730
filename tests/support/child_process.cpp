#include "tests/support/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

extern char** environ;

namespace farhand {

ChildProcess::ChildProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment) {
  int in[2], out[2];
  err_file_ = memfd_create("stderr", MFD_CLOEXEC);  // not a pipe: a child that says much must not wait for us
  if (err_file_ < 0 || pipe2(in, O_CLOEXEC) != 0 || pipe2(out, O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe for a child process");
  std::vector<char*> arguments, variables;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  // Ours first in the list: the first entry of a name is the one that counts.
  for (const std::string& variable : environment) variables.push_back(const_cast<char*>(variable.c_str()));
  for (char** variable = environ; *variable != nullptr; ++variable) variables.push_back(*variable);
  variables.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in[0], 0);
  posix_spawn_file_actions_adddup2(&actions, out[1], 1);
  posix_spawn_file_actions_adddup2(&actions, err_file_, 2);
  const int error = posix_spawn(&pid_, command.at(0).c_str(), &actions, nullptr, arguments.data(), variables.data());
  posix_spawn_file_actions_destroy(&actions);
  close(in[0]);
  close(out[1]);
  in_ = in[1];
  out_pipe_ = out[0];
  if (error != 0) throw std::runtime_error("cannot start " + command.at(0));
}

ChildProcess::~ChildProcess() {
  if (running()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  end_input();
  close(out_pipe_);
  close(err_file_);
}

void ChildProcess::say(const std::string& text) const {
  [[maybe_unused]] const ssize_t written = ::write(in_, text.data(), text.size());
}

void ChildProcess::end_input() {
  if (in_ >= 0) close(in_);
  in_ = -1;
}

void ChildProcess::send_signal(int signal) const { kill(pid_, signal); }

bool ChildProcess::running() {
  if (!ended_ && waitpid(pid_, &status_, WNOHANG) == pid_) ended_ = true;
  return !ended_;
}

bool ChildProcess::read_more() {
  pollfd wait{out_pipe_, POLLIN, 0};
  if (poll(&wait, 1, 60'000) <= 0) return false;
  char bytes[4096];
  const ssize_t got = ::read(out_pipe_, bytes, sizeof bytes);
  if (got <= 0) return false;
  out_.append(bytes, static_cast<std::size_t>(got));
  return true;
}

std::string ChildProcess::read_line() {
  std::size_t end = out_.find('\n', read_);
  while (end == std::string::npos && read_more()) end = out_.find('\n', read_);
  if (end == std::string::npos) return {};
  const std::string line = out_.substr(read_, end - read_);
  read_ = end + 1;
  return line;
}

int ChildProcess::wait() {
  while (read_more()) {
  }
  if (!ended_ && waitpid(pid_, &status_, 0) == pid_) ended_ = true;
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
}

std::string ChildProcess::err() const {
  std::string text(static_cast<std::size_t>(lseek(err_file_, 0, SEEK_END)), '\0');
  const ssize_t got = pread(err_file_, text.data(), text.size(), 0);
  text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return text;
}

}  // namespace farhand
