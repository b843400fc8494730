#include "slave/patient_buttons.hpp"

namespace farhand {
namespace {

volatile std::sig_atomic_t pressed = 0, released = 0;

void press(int) { pressed = 1; }
void release(int) { released = 1; }

}  // namespace

PatientButtons::PatientButtons() {
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  action.sa_handler = press;
  sigaction(SIGUSR1, &action, &previous_[0]);
  action.sa_handler = farhand::release;
  sigaction(SIGUSR2, &action, &previous_[1]);
}

PatientButtons::~PatientButtons() {
  sigaction(SIGUSR1, &previous_[0], nullptr);
  sigaction(SIGUSR2, &previous_[1], nullptr);
}

void PatientButtons::tick() noexcept {
  if (release_ms_ > 0) --release_ms_;
  if (released != 0) {
    released = 0;
    stop_ = false;
    release_ms_ = kUpMs + kHeldMs;
  }
  if (pressed != 0) {
    pressed = 0;
    stop_ = true;
  }
}

}  // namespace farhand
