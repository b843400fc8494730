// Where a command's results go.
#pragma once

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

namespace farhand {

// "-" is standard output, nothing is nowhere. Throws when the file cannot be written to its end.
template <class Write>
void write_to(const std::string& path, Write&& write) {
  if (path.empty()) return;
  if (path == "-") {
    write(std::cout);
    std::cout.flush();
    return;
  }
  std::ofstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot write " + path + ": " + std::strerror(errno));
  write(file);
  file.close();
  if (!file) throw std::runtime_error("could not write all of " + path + ": " + std::strerror(errno));
}

}  // namespace farhand
