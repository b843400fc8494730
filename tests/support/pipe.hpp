// A pipe whose other end speaks when the test says so.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

namespace farhand {

class Pipe {
 public:
  Pipe() { EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0); }
  ~Pipe() {
    close(ends_[0]);
    finish();
  }
  int out() const { return ends_[0]; }
  int in() const { return ends_[1]; }
  void say(const std::string& text) const {
    EXPECT_EQ(write(ends_[1], text.data(), text.size()), ssize_t(text.size()));
  }
  void finish() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  int ends_[2] = {-1, -1};
};

}  // namespace farhand
