#include "netem/lab/workload.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

#include "common/runtime/stop_signals.hpp"

namespace farhand {
namespace {

std::int64_t now_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count();
}

}  // namespace

struct Workload::Line {
  std::string what;
  bool shown = ::isatty(STDERR_FILENO) == 1;
  std::int64_t begun_ms = now_ms();
  std::atomic<std::int64_t> next_ms = begun_ms + 500;  // what is done at once needs no line
  std::atomic<bool> written = false;

  void show(std::size_t done, std::size_t total) {
    if (!shown) return;
    const std::int64_t now = now_ms();
    std::int64_t next = next_ms.load();
    if (now < next || !next_ms.compare_exchange_strong(next, now + 200)) return;
    const double s = 1e-3 * static_cast<double>(now - begun_ms), rate = static_cast<double>(done) / s;
    std::fprintf(stderr, "\r\033[K  %zu of %zu %s, %.3g a second, %.0f s left", done, total, what.c_str(), rate,
                 static_cast<double>(total - std::min(done, total)) / std::max(rate, 1e-9));
    written = true;
  }
  void wipe() {
    if (written) std::fputs("\r\033[K", stderr);
    written = false;
  }
};

Workload::Workload(int threads)
    : threads_(threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))) {}
Workload::Workload(int threads, std::string what) : Workload(threads) {
  signals_ = std::make_unique<StopSignals>();
  line_ = std::make_unique<Line>();
  line_->what = std::move(what);
}
Workload::~Workload() { wipe(); }

void Workload::done_one() const noexcept {
  const std::size_t done = ++done_;
  if (line_) line_->show(done, total_);
}

void Workload::wipe() const {
  if (line_) line_->wipe();
}

bool Workload::stopped() const noexcept { return signals_ && signals_->signal() != 0; }

void Workload::require_all(bool all) const {
  if (!all) throw Stopped{done_, total_, line_ ? line_->what : "pieces"};
}

bool Workload::each(std::size_t count, const std::function<void(std::size_t)>& piece) const {
  return each_of(count, count, [&](std::size_t k) {
    piece(k);
    done_one();
  });
}

bool Workload::each_of(std::size_t units, std::size_t count, const std::function<void(std::size_t)>& piece) const {
  done_ = 0;
  total_ = units;
  std::atomic<std::size_t> next{0};
  std::vector<std::exception_ptr> errors(count);
  std::atomic<bool> failed{false};
  const auto work = [&] {
    while (!failed && !stopped()) {
      const std::size_t k = next++;
      if (k >= count) break;
      try {
        piece(k);
      } catch (...) {
        errors[k] = std::current_exception();
        failed = true;
      }
    }
  };
  {
    std::vector<std::jthread> others;
    const auto wanted = std::min<std::size_t>(static_cast<std::size_t>(threads_), count);
    for (std::size_t k = 1; k < wanted; ++k) others.emplace_back(work);
    work();
  }
  wipe();
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
  return !stopped() || done_ >= total_;
}

}  // namespace farhand
