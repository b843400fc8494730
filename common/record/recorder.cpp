#include "common/record/recorder.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <new>

namespace farhand {

Recorder::Recorder(const std::filesystem::path& file, const record::RunInfo& start, std::size_t capacity)
    : ring_(capacity), recording_(file, start), writer_([this](const std::stop_token& stop) { run(stop); }) {}

Recorder::~Recorder() {
  if (!writer_.joinable()) return;
  writer_.request_stop();
  writer_.join();
}

void Recorder::run(const std::stop_token& stop) {
  // Somewhat shorter than a chunk may span, so that waking late does not cut a sliver off every chunk.
  constexpr auto kPeriod = std::chrono::milliseconds(200);
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    wake.wait_for(lock, stop, kPeriod, [] { return false; });
    drain();
  }
  drain();  // a stop may come before the first wait
}

void Recorder::drain() {
  Item item;
  while (ring_.pop(item)) {
    try {
      recording_.write(item.t, item.sample);
    } catch (const std::bad_alloc&) {  // no reason to stop a session either
      overflow_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  recording_.flush();
  if (!said_ && recording_.unwritten() > 0 && !recording_.last_error().empty()) {
    said_ = true;
    std::fprintf(stderr, "recording: %s: %s; the session goes on, what is not written is counted\n",
                 recording_.file().unfinished().c_str(), recording_.last_error().c_str());
  }
  flushed_.store(recording_.written(), std::memory_order_relaxed);
}

RecordingOutcome Recorder::finish(const StationCounters& counters, const DeviceFriction& friction) noexcept {
  if (writer_.joinable()) {
    writer_.request_stop();
    writer_.join();
  }
  recording_.friction(friction);
  return recording_.finish(counters, overflow());
}

}  // namespace farhand
