#include "tests/support/alloc_counter.hpp"

#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace farhand {
namespace {

// initial-exec: the usual model of a shared library would call malloc to create the counters that malloc counts with.
__attribute__((tls_model("initial-exec"))) thread_local constinit Touched counts;
__attribute__((tls_model("initial-exec"))) thread_local constinit int traces_left = 0;

// Where does it come from? With FARHAND_COUNT_TRACE set, the first few events after the first tick leave their call
// stack on stderr.
[[maybe_unused]] void trace() noexcept {
  if (traces_left <= 0) return;
  const int left = traces_left - 1;
  const Touched before = counts;
  traces_left = 0;  // the trace itself allocates
  void* frames[32];
  backtrace_symbols_fd(frames, backtrace(frames, 32), 2);
  [[maybe_unused]] const ssize_t written = ::write(2, "\n", 1);
  traces_left = left;
  counts = before;
}

[[maybe_unused]] void count_heap() noexcept {
  ++counts.heap;
  trace();
}

[[maybe_unused]] void count_lock() noexcept {
  ++counts.locks;
  trace();
}

}  // namespace

Touched touched() noexcept { return counts; }

}  // namespace farhand

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// glibc's own entry points under our names: dlsym would itself allocate.
extern "C" {
void* __libc_malloc(std::size_t) noexcept;
void* __libc_calloc(std::size_t, std::size_t) noexcept;
void* __libc_realloc(void*, std::size_t) noexcept;
void* __libc_memalign(std::size_t, std::size_t) noexcept;
void __libc_free(void*) noexcept;

void* malloc(std::size_t size) noexcept {
  farhand::count_heap();
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  farhand::count_heap();
  return __libc_calloc(count, size);
}

void* realloc(void* old, std::size_t size) noexcept {
  farhand::count_heap();
  return __libc_realloc(old, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  farhand::count_heap();
  return __libc_memalign(alignment, size);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  farhand::count_heap();
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** result, std::size_t alignment, std::size_t size) noexcept {
  farhand::count_heap();
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) return EINVAL;
  void* const memory = __libc_memalign(alignment, size);
  if (memory == nullptr) return ENOMEM;
  *result = memory;
  return 0;
}

void free(void* memory) noexcept {
  if (memory != nullptr) farhand::count_heap();
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  // Looked up by hand: the guard of a local static may itself take a mutex.
  static constinit Lock next = nullptr;
  Lock lock = __atomic_load_n(&next, __ATOMIC_RELAXED);
  if (lock == nullptr) {
    lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
    __atomic_store_n(&next, lock, __ATOMIC_RELAXED);
  }
  farhand::count_lock();
  return lock(mutex);
}
}

#endif

#ifdef FARHAND_COUNT_PRELOADED

namespace {
__attribute__((tls_model("initial-exec"))) thread_local constinit farhand::Touched at_begin;
}

// Called by the run loop, which looks for these names.
extern "C" __attribute__((visibility("default"))) void farhand_loop_thread_begin() {
  if (std::getenv("FARHAND_COUNT_TRACE") != nullptr) {
    void* frame[1];
    backtrace(frame, 1);  // its first call loads a library
    farhand::traces_left = 5;
  }
  at_begin = farhand::counts;
}

extern "C" __attribute__((visibility("default"))) void farhand_loop_thread_end() {
  const farhand::Touched now = farhand::counts;
  farhand::traces_left = 0;
  char line[160];
  const int size =
      std::snprintf(line, sizeof line, "farhand-count %s pid %d heap %llu locks %llu\n", program_invocation_short_name,
                    static_cast<int>(getpid()), static_cast<unsigned long long>(now.heap - at_begin.heap),
                    static_cast<unsigned long long>(now.locks - at_begin.locks));
  const char* path = std::getenv("FARHAND_COUNT_FILE");
  const int fd = path != nullptr ? open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644) : 2;
  [[maybe_unused]] const ssize_t written = ::write(fd, line, static_cast<std::size_t>(size));
  if (path != nullptr) close(fd);
}

#endif
