// The counter sees what it must see, in both its forms; and what the loop calls at the edges to the system stays at
// zero.
#include "tests/support/alloc_counter.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <stdlib.h>

#include <array>
#include <fstream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/exchange/latest.hpp"
#include "common/link/udp.hpp"
#include "common/runtime/live_status.hpp"
#include "common/runtime/operator_input.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/runtime/stop_input.hpp"

namespace farhand {
namespace {

class Counter : public testing::Test {
 protected:
  void SetUp() override {
    if (kCounterIsBlind) GTEST_SKIP() << "a sanitizer owns malloc and the mutexes";
  }
};

TEST_F(Counter, SeesADeliberateAllocationInEveryForm) {
  const TouchCounter counter;
  {
    int* volatile number = new int(1);
    delete number;
  }
  EXPECT_EQ(counter.since(), (Touched{2, 0}));
  void* volatile memory = malloc(16);
  memory = realloc(memory, 4000);
  free(memory);
  EXPECT_EQ(counter.since(), (Touched{5, 0}));
  memory = calloc(3, 5);
  free(memory);
  memory = aligned_alloc(64, 128);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 64, 0u);
  free(memory);
  void* aligned = nullptr;
  EXPECT_EQ(posix_memalign(&aligned, 3, 16), EINVAL);
  EXPECT_EQ(posix_memalign(&aligned, 256, 16), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(aligned) % 256, 0u);
  free(aligned);
  struct alignas(128) Wide {
    char bytes[128];
  };
  Wide* volatile wide = new Wide;
  delete wide;
  free(nullptr);
  EXPECT_EQ(counter.since(), (Touched{14, 0}));
}

TEST_F(Counter, SeesADeliberateLock) {
  std::mutex mutex;
  pthread_mutex_t plain = PTHREAD_MUTEX_INITIALIZER;
  const TouchCounter counter;
  { const std::lock_guard lock(mutex); }
  pthread_mutex_lock(&plain);
  pthread_mutex_unlock(&plain);
  EXPECT_EQ(counter.since(), (Touched{0, 2}));
}

TEST_F(Counter, CountsEachThreadForItself) {
  const TouchCounter counter;
  Touched other, mine;
  std::thread thread([&] {
    const TouchCounter own;
    std::vector<std::unique_ptr<int>> many;
    for (int i = 0; i < 1000; ++i) many.push_back(std::make_unique<int>(i));
    other = own.since();
  });
  mine = counter.since();  // before join: starting a thread allocates here, but not a thousand times
  thread.join();
  EXPECT_GE(other.heap, 1000u);
  EXPECT_LT(mine.heap, 100u);
}

TEST_F(Counter, ZeroInTheLoopAndInItsEdgesAfterTheFirstTick) {
  const UdpEndpoint any = parse_endpoint("127.0.0.1:0", EndpointUse::kListen);
  UdpSocket listener = UdpSocket::listen(any);
  UdpSocket dialer = UdpSocket::dial(listener.local_endpoint());
  UdpEndpoint gone;
  {
    UdpSocket socket = UdpSocket::listen(any);
    gone = socket.local_endpoint();
  }
  UdpSocket to_nobody = UdpSocket::dial(gone);
  Latest<std::array<double, 8>> latest;
  LiveStatusPrinter printer(true);
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  OperatorInput input(ends[0]);
  ASSERT_EQ(write(ends[1], "engage\nnonsense\nhold\n", 21), 21);
  int pedal[2];
  ASSERT_EQ(pipe(pedal), 0);
  StopInput stop_input("fd:" + std::to_string(pedal[0])), stop_file(__FILE__);
  std::uint64_t presses = 0;

  std::array<std::byte, 100> bytes{};
  std::array<std::byte, 200> buffer{};
  Touched first, last;
  std::uint64_t received = 0;
  run({.period_ns = kMillisecond / 10}, [&](const TickTime& time) noexcept {
    if (time.index == 1) first = touched();
    dialer.send(bytes);
    to_nobody.send(bytes);
    to_nobody.receive(buffer);
    while (const auto got = listener.receive(buffer)) {
      listener.accept(got->sender);
      listener.send(std::span(buffer).first(got->size));
      ++received;
    }
    dialer.receive(buffer);
    EXPECT_EQ(listener.dropped_by_kernel(), 0u);
    latest.write({});
    printer.show({});
    input.poll(time.now_ns);
    if (time.index % 2 == 0 && write(pedal[1], "x", 1) != 1) return false;
    presses += stop_input.pressed() + stop_file.pressed();
    last = touched();
    return time.index < 2000;
  });
  EXPECT_EQ(last, first);
  EXPECT_GE(received, 1000u);
  EXPECT_EQ(presses, 1001u);
  EXPECT_GE(to_nobody.counters().refused, 1000u);
  for (const int fd : {ends[0], ends[1], pedal[0], pedal[1]}) close(fd);
}

std::string preloaded_report(const char* what) {
  char path[] = "/tmp/farhand_count_XXXXXX";
  close(mkstemp(path));
  const std::string command =
      std::string("FARHAND_COUNT_FILE=") + path + " LD_PRELOAD=" FARHAND_COUNT " " FARHAND_COUNTED_LOOP " " + what;
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  unlink(path);
  return text.str();
}

TEST_F(Counter, PreloadedItReportsTheLoopThreadOfAnotherProgram) {
  EXPECT_NE(preloaded_report("clean").find("heap 0 locks 0\n"), std::string::npos) << preloaded_report("clean");
  EXPECT_NE(preloaded_report("heap").find("heap 20 locks 0\n"), std::string::npos) << preloaded_report("heap");
  EXPECT_NE(preloaded_report("lock").find("heap 0 locks 10\n"), std::string::npos) << preloaded_report("lock");
}

}  // namespace
}  // namespace farhand
