// Records samples of a loop thread without ever delaying it. push copies a plain struct into a ring; a second thread
// turns the structs into messages and flushes a chunk at least every 250 ms. A full ring or a full disk costs samples,
// never time. Lost samples are counted, and the first one that the disk does not take is reported on stderr.
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

#include "common/exchange/spsc_ring.hpp"
#include "common/record/recording.hpp"

namespace farhand {

class Recorder {
 public:
  // 16,384 samples are 8 s of the fastest producer, the MCU emulator at 2 kHz, which is longer than any known stall of
  // a disk.
  static constexpr std::size_t kCapacity = 16'384;

  // Throws like Recording.
  Recorder(const std::filesystem::path& file, const record::RunInfo& start, std::size_t capacity = kCapacity);
  ~Recorder();  // without finish(): everything pushed is flushed, but the file keeps its unfinished name

  // All from one thread. `sample` is a StationSample, LinkSample or McuSample, as fits the role.
  template <class T>
  void push(Nanoseconds t, const T& sample) noexcept {
    if (!ring_.push({t, Sample(sample)})) overflow_.fetch_add(1, std::memory_order_relaxed);
  }
  void note(Nanoseconds t, std::string_view sentence) noexcept { push(t, Note(sentence)); }

  // After the loop: stops the thread, writes what is left, the counters and the friction in force (the box only),
  // completes the file.
  RecordingOutcome finish(const StationCounters& counters, const DeviceFriction& friction = {}) noexcept;

  const NewFile& file() const { return recording_.file(); }

  std::uint64_t flushed() const noexcept {
    return flushed_.load(std::memory_order_relaxed);
  }  // messages in flushed chunks
  std::uint64_t overflow() const noexcept { return overflow_.load(std::memory_order_relaxed); }

 private:
  struct Item {
    Nanoseconds t = 0;
    Sample sample;
  };

  void run(const std::stop_token& stop);
  void drain();

  SpscRing<Item> ring_;
  std::atomic<std::uint64_t> overflow_{0}, flushed_{0};
  Recording recording_;
  bool said_ = false;    // whether a loss by the disk was reported; later ones are only counted
  std::jthread writer_;  // last member: starts after all others are made
};

}  // namespace farhand
