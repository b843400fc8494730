// Puts the shipped preload library under a test program, so that the real serial library opens pseudo terminals in it.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace farhand {

// First thing in main(): starts the program again with the library preloaded, unless it already is.
inline void restart_with_pty_modem(char** argv) {
  if (std::getenv("FARHAND_PTY_MODEM_LOADED") != nullptr) return;
  setenv("FARHAND_PTY_MODEM_LOADED", "1", 1);
  setenv("LD_PRELOAD", FARHAND_PTY_MODEM, 1);
  const char* asan = std::getenv("ASAN_OPTIONS");
  setenv("ASAN_OPTIONS",
         ((asan != nullptr ? std::string(asan) + ":" : std::string()) + "verify_asan_link_order=0").c_str(), 1);
  execv("/proc/self/exe", argv);
  std::perror("cannot restart with the preload library");
  std::exit(1);
}

}  // namespace farhand
