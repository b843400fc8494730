// One target under libFuzzer: FARHAND_FUZZ_TARGET is its function.
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    farhand::fuzz::FARHAND_FUZZ_TARGET({data, size});
  } catch (const farhand::fuzz::Broken& broken) {
    std::fprintf(stderr, "broken: %s\n", broken.promise);
    std::abort();
  }
  return 0;
}
