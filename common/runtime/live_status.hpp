// One line that shows a running session. The loop only hands over numbers; a second thread prints them to stderr,
// repeatedly in place on a terminal, or as a line every two seconds into a file or pipe.
#pragma once

#include <condition_variable>
#include <limits>
#include <mutex>
#include <string>
#include <thread>

#include "common/exchange/latest.hpp"
#include "common/link/packet.hpp"

namespace farhand {

struct LiveStatus {
  double t_s = 0;
  StationState state = StationState::kOff;
  double x_m_rad = 0, x_s_rad = 0;
  double f_m_nm = 0, f_s_nm = 0;
  double rtt_s = 0;       // NaN while unknown
  double loss_share = 0;  // of the packets from the peer, 0..1; NaN while unknown
  double line_s =
      std::numeric_limits<double>::quiet_NaN();            // of a command on the serial line and its echo; NaN without
  bool line_lags = false;                                  // that is 10 ms more than the line needs
  bool line_blind = false;                                 // this PC reads too late to measure it
  bool line_slow = false;                                  // it was refused because it needs too much time
  std::uint32_t therapist_limits = 0, patient_limits = 0;  // LimitBit, those that are near too
  std::uint64_t dropped = 0, unsent = 0;                   // datagrams that were not accepted, and that were not sent
  std::uint64_t cut = 0;        // ticks in which the peer asked for more than this side allows
  bool waits = false;           // holds for a gap of the network, after which it may go on without an act
  std::uint64_t resumed = 0;    // so often in the last minute
  bool tendons_harder = false;  // than at the fitting
};

inline constexpr const char* kLineSlowSentence =
    "the serial line takes more than 8 ms for a command and its echo, or the MCU does not tell (firmware below 5): set "
    "the latency timer of the adapter to 1 ms (FTDI: /sys/bus/usb-serial/devices/ttyUSB*/latency_timer)";

inline constexpr const char* kPcLateSentence =
    "this PC looks too late at its serial line to tell how long that takes: its own ticks are late (runtime.priority "
    "in "
    "the scene, fewer programs, or a longer tick_s)";
// The sentence for a line that Self-test refused.
inline constexpr const char* slow_line_sentence(bool blind) { return blind ? kPcLateSentence : kLineSlowSentence; }

std::string format_live_status(const LiveStatus& status);

class LiveStatusPrinter {
 public:
  explicit LiveStatusPrinter(bool quiet, int fd = 2);
  ~LiveStatusPrinter();
  LiveStatusPrinter(const LiveStatusPrinter&) = delete;
  LiveStatusPrinter& operator=(const LiveStatusPrinter&) = delete;

  // From the loop thread only.
  void show(const LiveStatus& status) noexcept { latest_.write(status); }

 private:
  void print_until_stopped();
  void print(const LiveStatus& status);

  int fd_;
  bool terminal_;
  bool line_open_ = false;
  Latest<LiveStatus> latest_;
  std::mutex mutex_;  // only to wake the printer at the end
  std::condition_variable stopped_;
  bool stop_ = false;
  std::thread printer_;
};

}  // namespace farhand
