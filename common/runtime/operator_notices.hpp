// Prints on stderr why an operator's input had no effect (input_remark.hpp): a line for each remark, at most one a
// second, the newest. It uses a thread of its own, because the loop must not wait for a terminal.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "common/runtime/operator_input.hpp"

namespace farhand {

class OperatorNotices {
 public:
  OperatorNotices(const std::string& program, OperatorInput& input, int fd = 2);
  ~OperatorNotices();
  OperatorNotices(const OperatorNotices&) = delete;
  OperatorNotices& operator=(const OperatorNotices&) = delete;

 private:
  void say_what_comes() noexcept;
  bool say() noexcept;

  std::string program_;
  OperatorInput& input_;
  int fd_;
  bool terminal_;
  std::atomic<bool> over_{false};
  std::thread speaker_;
};

}  // namespace farhand
