#include "common/runtime/friction_keeper.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stdexcept>

#include "common/files/output.hpp"

namespace farhand {

FrictionKeeper::FrictionKeeper(const std::filesystem::path& file, std::int64_t utc_s)
    : file_(file), start_utc_s_(utc_s) {
  if (!file_.empty()) last_ = load_friction(file_);
  DeviceFriction start{.threshold_nm = known().threshold, .measured = known().known};
  if (last_) start.F_c_nm = last_->F_c, start.spread_nm = last_->spread, start.swept_utc_s = last_->utc_s;
  in_force_ = FrictionInForce(start);
  if (file_.empty()) return;
  try {  // else a person would sweep for nothing
    require_output(file_);
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument("friction file " + file_.string() + ": no result could be kept: " + error.what());
  }
  writer_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

FrictionKeeper::~FrictionKeeper() { finish(); }

std::string FrictionKeeper::sentence() const {
  return file_.empty() ? no_friction_file_sentence() : friction_sentence(last_, start_utc_s_);
}

void FrictionKeeper::ticked(const StationTick& tick) noexcept {
  const TickTrace<1>& trace = tick.side.trace();
  // By the clock of the loop: a result is never taken for newer than it is.
  const std::int64_t utc_s = start_utc_s_ + static_cast<std::int64_t>(tick.t_s);
  if (!in_force_.step(trace, utc_s) || file_.empty()) return;
  if (!results_.push({utc_s, trace.swept.F_c, trace.swept.spread})) lost_ = true;
}

void FrictionKeeper::run(const std::stop_token& stop) {
  constexpr auto kPeriod = std::chrono::milliseconds(100);  // the tick wakes nobody
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    wake.wait_for(lock, stop, kPeriod, [] { return false; });
    write();
  }
  write();  // a stop may come before the first wait
}

void FrictionKeeper::write() {
  SweptFriction result;
  while (results_.pop(result)) {
    try {
      add_friction(file_, result);
      std::fprintf(stderr, "farhand-slave: %s\n", friction_sentence(result, result.utc_s).c_str());
    } catch (const std::exception& error) {
      lost_ = true;
      std::fprintf(stderr, "farhand-slave: the friction that was measured, %.4f N m, is not kept: %s\n", result.F_c,
                   error.what());
    }
  }
}

bool FrictionKeeper::finish() {
  if (writer_.joinable()) {
    writer_.request_stop();
    writer_.join();
  }
  return !lost_;
}

}  // namespace farhand
