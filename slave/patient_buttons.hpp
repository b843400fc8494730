// The buttons at the emulated orthosis, pressed by signals: SIGUSR1 presses the patient's stop, SIGUSR2 lets it up and
// then holds the release key beside it for a fifth of a second.
#pragma once

#include <array>
#include <csignal>

namespace farhand {

class PatientButtons {
 public:
  PatientButtons();  // takes the signals over
  ~PatientButtons();
  PatientButtons(const PatientButtons&) = delete;
  PatientButtons& operator=(const PatientButtons&) = delete;

  // A millisecond has passed.
  void tick() noexcept;
  bool stop() const noexcept { return stop_; }
  bool release() const noexcept { return release_ms_ > 0 && release_ms_ <= kHeldMs; }

 private:
  static constexpr int kUpMs = 5, kHeldMs = 200;  // both up, then the key down

  std::array<struct sigaction, 2> previous_{};
  bool stop_ = false;
  int release_ms_ = 0;
};

}  // namespace farhand
