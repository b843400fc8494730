// A long computation in pieces, on several threads: how far it is stands on one line of stderr where that is a
// terminal, and a signal (Ctrl-C) ends it after the pieces that run.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace farhand {

class StopSignals;

// Not an error: somebody wanted it to end.
struct Stopped {
  std::size_t done, total;
  std::string what;
};

class Workload {
 public:
  // threads: 0 for one per core. Says nothing and hears no signal.
  Workload(int threads = 1);  // NOLINT: a number of threads is a way to work
  // what: the pieces, in the plural. From here to the end of this object signals stop the work, not the program.
  Workload(int threads, std::string what);
  ~Workload();
  Workload(const Workload&) = delete;
  Workload& operator=(const Workload&) = delete;

  int threads() const noexcept { return threads_; }

  // Calls piece(k) once for each k below count, in that order, whichever thread is free. False: a signal ended it, and
  // the pieces that did not run are the last ones. What the first of the pieces throws is thrown again once all threads
  // have ended; the pieces behind it do not run.
  bool each(std::size_t count, const std::function<void(std::size_t)>& piece) const;
  // So too, where a piece says itself of how many units it has done one: finer than a piece.
  bool each_of(std::size_t units, std::size_t count, const std::function<void(std::size_t)>& piece) const;
  void done_one() const noexcept;

  bool stopped() const noexcept;
  // Takes the line off the screen, before something else is written there.
  void wipe() const;
  // Throws Stopped where a signal ended it.
  void require_all(bool all) const;

 private:
  struct Line;
  int threads_;
  std::unique_ptr<StopSignals> signals_;
  std::unique_ptr<Line> line_;  // none: silent
  mutable std::atomic<std::size_t> done_{0};
  mutable std::size_t total_ = 0;
};

}  // namespace farhand
