// A long computation in pieces, on several threads. Its progress is shown on one line of stderr if that is a terminal,
// and a signal (Ctrl-C) ends it after the pieces that are running.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace farhand {

class StopSignals;

// Thrown when a user ends the work; it is not an error.
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

  // Calls piece(k) once for each k below count, in that order, on any free thread. Returns false if a signal ended the
  // work; the last pieces then did not run. If pieces throw, the exception of the first one is thrown again after all
  // threads have ended; the pieces behind it do not run.
  bool each(std::size_t count, const std::function<void(std::size_t)>& piece) const;
  // The same with finer progress: each piece reports the units that it has done.
  bool each_of(std::size_t units, std::size_t count, const std::function<void(std::size_t)>& piece) const;
  void done_one() const noexcept;

  bool stopped() const noexcept;
  // Removes the line from the screen, before other output is written there.
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
