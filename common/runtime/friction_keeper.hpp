// The friction of the patient's device over a session: what its file says at the start, and every sweep that the box
// then completes. A result is in the file a moment after the sweep, so that neither a crash nor a later sweep that is
// refused loses it. A thread of its own writes; the tick only hands the result over.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <thread>

#include "common/exchange/spsc_ring.hpp"
#include "common/record/friction_in_force.hpp"
#include "common/runtime/friction_file.hpp"
#include "common/runtime/station_ports.hpp"

namespace farhand {

class FrictionKeeper final : public TickWatcher {
 public:
  // file: empty if nothing shall be kept. utc_s: now. Throws std::invalid_argument like load_friction(), and if no file
  // can be made there.
  FrictionKeeper(const std::filesystem::path& file, std::int64_t utc_s);
  ~FrictionKeeper() override;

  // For the session, and in words.
  KnownFriction known() const { return friction_for(last_, start_utc_s_); }
  std::string sentence() const;

  void ticked(const StationTick& tick) noexcept override;

  // For the recording; not while the loop runs.
  const DeviceFriction& in_force() const { return in_force_.now(); }

  // After the loop: writes what is left. False if a result could not be written, which was said on stderr.
  bool finish();

 private:
  void run(const std::stop_token& stop);
  void write();

  std::filesystem::path file_;
  std::int64_t start_utc_s_;
  std::optional<SweptFriction> last_;
  FrictionInForce in_force_;
  SpscRing<SweptFriction> results_{16};
  std::atomic<bool> lost_{false};
  std::jthread writer_;  // last member: starts after all others are made
};

}  // namespace farhand
