// Datagrams on their way, the earliest due first; those due at the same moment leave in the order in which they came.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/signal/joints.hpp"

namespace farhand {

class PendingDatagrams {
 public:
  static constexpr std::size_t kMaxBytes = 512;  // the longest datagram of a handshake, and the stamp

  // Allocates all memory.
  explicit PendingDatagrams(std::size_t capacity) : slots_(capacity) {
    heap_.reserve(capacity);
    free_.reserve(capacity);
    for (std::size_t i = capacity; i-- > 0;) free_.push_back(i);
  }

  // Returns false and keeps nothing if it is full or the datagram is too long.
  bool push(Nanoseconds due, std::span<const std::byte> bytes) noexcept {
    if (free_.empty() || bytes.size() > kMaxBytes) return false;
    const std::size_t slot = free_.back();
    free_.pop_back();
    std::copy(bytes.begin(), bytes.end(), slots_[slot].bytes.begin());
    slots_[slot].size = bytes.size();
    heap_.push_back({due, next_++, slot});
    std::push_heap(heap_.begin(), heap_.end(), later);
    return true;
  }

  bool empty() const noexcept { return heap_.empty(); }
  std::size_t size() const noexcept { return heap_.size(); }
  // Of the next one; only if not empty.
  Nanoseconds due() const noexcept { return heap_.front().due; }
  // The next one; only if not empty. Valid until the next push.
  std::span<const std::byte> pop() noexcept {
    const std::size_t slot = heap_.front().slot;
    std::pop_heap(heap_.begin(), heap_.end(), later);
    heap_.pop_back();
    free_.push_back(slot);
    return std::span(slots_[slot].bytes).first(slots_[slot].size);
  }

 private:
  struct Slot {
    std::array<std::byte, kMaxBytes> bytes;
    std::size_t size;
  };
  struct Entry {
    Nanoseconds due;
    std::uint64_t order;
    std::size_t slot;
  };
  static bool later(const Entry& a, const Entry& b) noexcept {
    return a.due != b.due ? a.due > b.due : a.order > b.order;
  }

  std::vector<Slot> slots_;
  std::vector<Entry> heap_;
  std::vector<std::size_t> free_;
  std::uint64_t next_ = 0;
};

}  // namespace farhand
