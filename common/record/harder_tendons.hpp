// Whether the tendons of the patient's device run harder than when they were fitted: the friction that the therapist's
// station identifies in motion against what a sweep without the hand has found, which the box tells. Told once in a
// session. Without such a sweep of the last day there is nothing to compare with.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "common/link/packet.hpp"
#include "common/record/session.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

class HarderTendons {
 public:
  // Harder by this is more than the estimate errs, and may be felt: N m.
  static constexpr double kHarder = 0.05;
  static constexpr std::string_view kSignal = "friction_nm";

  HarderTendons() = default;
  // signals: names of the law's signals of the therapist's side. force_scale: of the session.
  HarderTendons(const std::vector<std::string>& signals, double force_scale)
      : signal_(static_cast<std::size_t>(std::ranges::find(signals, kSignal) - signals.begin())),
        force_scale_(force_scale) {
    if (signal_ == signals.size()) signal_ = kMostLawSignals;
  }

  // After each tick. newest: the box's packet. The sentence is empty but for once, and valid until the next call.
  std::string_view step(const TickTrace<1>& trace, const Packet<1>& newest) noexcept {
    if (harder_ || signal_ >= kMostLawSignals || !newest.friction_known) return {};
    const double identified = trace.law.own[signal_] / force_scale_;
    harder_ = identified > newest.friction + kHarder;
    if (!harder_) return {};
    const int length =
        std::snprintf(text_.data(), text_.size(),
                      "tendons run harder than at the fitting: friction %.3f N m, and %.3f N m without the hand",
                      identified, newest.friction);
    return {text_.data(), std::min(static_cast<std::size_t>(std::max(length, 0)), text_.size() - 1)};
  }
  bool harder() const noexcept { return harder_; }

 private:
  std::array<char, 160> text_{};
  std::size_t signal_ = kMostLawSignals;
  double force_scale_ = 1.0;
  bool harder_ = false;
};

}  // namespace farhand
