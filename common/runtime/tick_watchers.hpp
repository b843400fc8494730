// The observers of a station's ticks: its recording and the status line.
#pragma once

#include "common/record/harder_tendons.hpp"
#include "common/record/recorder.hpp"
#include "common/runtime/live_status.hpp"
#include "common/runtime/station_ports.hpp"
#include "common/station/journal.hpp"

namespace farhand {

class RecordingWatcher final : public TickWatcher {
 public:
  RecordingWatcher(Recorder& recorder, const HarderTendons& tendons) noexcept
      : recorder_(recorder), tendons_(tendons) {}
  void ticked(const StationTick& tick) noexcept override;

 private:
  Recorder& recorder_;
  Journal journal_;
  HarderTendons tendons_;
};

class StatusWatcher final : public TickWatcher {
 public:
  StatusWatcher(LiveStatusPrinter& printer, Role role, const HarderTendons& tendons) noexcept
      : printer_(printer), tendons_(tendons), leads_(role == Role::kLeader) {}
  void ticked(const StationTick& tick) noexcept override;

 private:
  LiveStatusPrinter& printer_;
  HarderTendons tendons_;
  bool leads_;
};

// Datagrams that came and were not accepted, for any reason.
std::uint64_t dropped(const StationCounters& counters) noexcept;

}  // namespace farhand
