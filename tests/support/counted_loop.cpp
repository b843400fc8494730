// A real run loop whose ticks do what the argument says (clean, heap, lock), for the test of the preloaded counter.
#include <cstdlib>
#include <mutex>
#include <string>

#include "common/runtime/run_loop.hpp"

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "clean";
  std::mutex mutex;
  farhand::run({}, [&](const farhand::TickTime& time) noexcept {
    // In the first tick everything is allowed.
    if (time.index == 0 || what == "heap") {
      void* volatile memory = std::malloc(16);
      std::free(memory);
    }
    if (time.index == 0 || what == "lock") {
      const std::lock_guard lock(mutex);
    }
    return time.index < 10;
  });
}
