// The observers of a station's ticks: its recording and the status line.
#pragma once

#include "common/record/recorder.hpp"
#include "common/runtime/live_status.hpp"
#include "common/runtime/station_ports.hpp"
#include "common/station/journal.hpp"

namespace farhand {

class RecordingWatcher final : public TickWatcher {
 public:
  explicit RecordingWatcher(Recorder& recorder) noexcept : recorder_(recorder) {}
  void ticked(const StationTick& tick) noexcept override;

 private:
  Recorder& recorder_;
  Journal journal_;
};

class StatusWatcher final : public TickWatcher {
 public:
  StatusWatcher(LiveStatusPrinter& printer, Role role) noexcept : printer_(printer), leads_(role == Role::kLeader) {}
  void ticked(const StationTick& tick) noexcept override;

 private:
  LiveStatusPrinter& printer_;
  bool leads_;
};

// Datagrams that came and were not accepted, for any reason.
std::uint64_t dropped(const StationCounters& counters) noexcept;

}  // namespace farhand
