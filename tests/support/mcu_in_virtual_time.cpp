// The emulated orthosis at the end of its cable, in virtual time, for a script on the other side of two pipes. Lines
// in:
//
//   until NANOSECONDS [BYTES]   sends the bytes now, then goes on until something comes or it is that late
//   stop 0|1, release 0|1       the patient's buttons
//
// A line out for each `until`: the time reached and the bytes that came, if any; all bytes in hexadecimal.
#include <charconv>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "slave/emulator_params.hpp"
#include "slave/mcu/emulator.hpp"

int main(int argc, char** argv) {
  using namespace farhand;
  if (argc != 2) return 2;
  OrthosisOnSerial orthosis(emulator_params(load_scene(argv[1]).scene), 10 * 10.0 / 115200);
  constexpr Nanoseconds kStep = 250'000;
  Nanoseconds now = 0;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string word, hex;
    Nanoseconds value = 0;
    words >> word >> value >> hex;
    if (word == "stop") orthosis.emulator().press_stop(value != 0);
    if (word == "release") orthosis.emulator().press_release(value != 0);
    if (word != "until") continue;
    std::vector<std::uint8_t> bytes(hex.size() / 2);
    for (std::size_t k = 0; k < bytes.size(); ++k)
      std::from_chars(hex.data() + 2 * k, hex.data() + 2 * k + 2, bytes[k], 16);
    orthosis.send(bytes.data(), bytes.size(), now);
    std::string came;
    while (came.empty() && now < value) {
      now = std::min(value, now + kStep);
      orthosis.advance(now);
      std::uint8_t byte = 0;
      while (orthosis.receive(now, byte)) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", byte);
        came += digits;
      }
    }
    std::cout << now << ' ' << came << std::endl;
  }
  return 0;
}
