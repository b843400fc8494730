// Age of a serial line: the time that a command and its echo are under way, by the PC's clock alone. The MCU reports
// the number of the newest command that it has. The age of the line, for both directions together, is the time since
// the oldest command that it does not have was sent. A late host must not be taken for a line that lags: a frame that
// waited for the host may have come at any time since its last look.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "common/device/mcu_frame.hpp"
#include "common/station/drive_io.hpp"

namespace farhand {

class LineAge {
 public:
  static constexpr double kMost = 0.008;     // s, largest time that the line may need: more is refused in Self-test
  static constexpr double kWarned = 0.010;   // s, beyond its need
  static constexpr double kTooOld = 0.020;   // s, beyond its need
  static constexpr std::uint8_t kTells = 5;  // the first firmware that reports numbers
  // s, from command to command: no frame is shorter, and with a longer tick the need of the line, which is only known
  // to within a tick, would be too large.
  static constexpr double kShortestTick = 10 * 10 / 115200.0, kLongestTick = 0.005;

  // tick_s: time from command to command.
  explicit LineAge(double tick_s = 0.001) noexcept : tick_s_(tick_s) {}

  // Returns the number of the command that is sent now.
  std::uint16_t send(double t_s) noexcept {
    earliest_s_[sent_ % kKept] = latest_s_[sent_ % kKept] = t_s;
    return static_cast<std::uint16_t>(sent_++ % mcu::kNumbers);
  }

  // Call begin, then the next function for each frame that waited, then end. tells: the MCU reports numbers.
  void begin(double t_s) noexcept {
    gap_s_ = t_s - read_s_;
    late_ = gap_s_ > 1.5 * tick_s_;
    // The last command before the gap may have left as late as the time at which this loop came back.
    if (late_ && sent_ > 0) latest_s_[(sent_ - 1) % kKept] = t_s - tick_s_;
    if (late_) resumed_ = sent_;
    frames_ = after_ = 0;
    echoed_ = false;
  }
  void take(const mcu::Telemetry& telemetry, bool tells) noexcept {
    ++frames_, ++after_;
    const mcu::SlowPage page = mcu::slow_page(telemetry.seq);
    if (page == mcu::SlowPage::kNumberHigh) high_ = telemetry.slow, high_seq_ = telemetry.seq;
    if (page != mcu::SlowPage::kNumberLow || !tells || telemetry.seq != high_seq_ + 1) return;
    // The low bits are a frame newer than the high ones: the number is the first one from there on with these low bits.
    const unsigned at_least = high_ * 16u;
    const unsigned number = at_least + ((telemetry.slow - at_least) & 255u);
    const std::uint64_t behind = (sent_ - 1 - number) % mcu::kNumbers;
    if (behind >= sent_) return;  // never sent by this program
    behind_ = behind, after_ = 0, echoed_ = true;
  }
  // Returns true if the age was measured. An echo that waited for a late host, or of a command from before the host was
  // late, only gives an upper bound of the age, unless even its lower bound is too large.
  bool end(double t_s) noexcept {
    read_s_ = t_s;
    if (!echoed_) return false;
    const std::uint64_t newest = sent_ - 1 - behind_;
    const double under_way_since = behind_ > 0 ? latest_s_[(sent_ - std::min(behind_, kKept)) % kKept] : t_s;
    // An adapter that collects frames delays them by half a collection in the mean, whichever frame holds the echo.
    const double shift = late_ ? 0.0 : kFrame * (0.5 * (frames_ - 1) - after_);
    const double arrived = late_ ? t_s - gap_s_ + tick_s_ : t_s;
    const double age = tick_s_ + std::max(0.0, std::max(0.0, arrived - under_way_since) + shift);
    // An upper bound, so that a pause of the host makes no line look faster than it is.
    const double most = behind_ < kKept ? std::max(tick_s_, t_s - earliest_s_[newest % kKept] + shift) : age;
    need_s_ = std::min(need_s_, most);
    const bool unknown = newest < resumed_ && age <= need_s_ + kWarned;
    blind_ = unknown && t_s - measured_s_ > kBlind;
    if (unknown) return false;
    age_s_ = age;
    measured_s_ = t_s;
    most_s_ = std::max(most_s_, age_s_);
    if (age_s_ > need_s_ + kWarned) ++warned_;
    return true;
  }

  LineQuality quality() const noexcept {
    if (need_s_ == kUnknown) return LineQuality::kUnknown;
    if (age_s_ > need_s_ + kTooOld) return LineQuality::kLags;
    return need_s_ > kMost ? LineQuality::kSlow : LineQuality::kGood;
  }
  bool warns() const noexcept { return need_s_ != kUnknown && age_s_ > need_s_ + kWarned; }

  // Starts a new measurement of the time that the line needs.
  void forget() noexcept {
    need_s_ = kUnknown;
    measured_s_ = read_s_;
    blind_ = false;
  }

  // True if echoes come, but for kBlind this host has looked too late to know their age.
  bool blind() const noexcept { return blind_; }

  double age_s() const noexcept { return age_s_; }    // of the last echo that showed it; 0 before the first
  double need_s() const noexcept { return need_s_; }  // the least; infinite while unknown
  double most_s() const noexcept { return most_s_; }
  std::uint64_t warned() const noexcept { return warned_; }  // echoes that were more than kWarned beyond the need

 private:
  static constexpr double kFrame = 0.001;       // s, from frame to frame of the MCU
  static constexpr double kBlind = 0.2;         // s, a dozen echoes
  static constexpr std::uint64_t kKept = 1024;  // commands; older ones are only known to be older
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();

  std::array<double, kKept> earliest_s_{}, latest_s_{};  // when a command may have left
  std::uint64_t sent_ = 0, behind_ = 0, resumed_ = 0,
                warned_ = 0;  // resumed_: first one since the host was late
  std::uint8_t high_ = 0, high_seq_ = 255;
  int frames_ = 0, after_ = 0;
  bool late_ = false, echoed_ = false, blind_ = false;
  double tick_s_, read_s_ = 0.0, gap_s_ = 0.0, measured_s_ = 0.0;
  double age_s_ = 0.0, need_s_ = kUnknown, most_s_ = 0.0;
};

}  // namespace farhand
