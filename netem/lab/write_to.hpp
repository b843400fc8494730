// Outputs of a command.
#pragma once

#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <string>

#include "common/files/output_stream.hpp"

namespace farhand {

// "-" is standard output, an empty name is no output, every other name a new file (common/files/output.hpp); if the
// name is taken, the new name is printed on stderr. Returns the file's name. Throws std::runtime_error if not all data
// could be written. kKept: partial data are useful, and are kept if the rest cannot be written.
enum class Partial : std::uint8_t { kRemoved, kKept };

template <class Write>
std::filesystem::path write_to(const std::string& path, Write&& write, Partial partial = Partial::kRemoved) {
  if (path.empty()) return {};
  if (path == "-") {
    write(std::cout);
    if (!std::cout.flush()) throw std::runtime_error("could not write all of it to standard output");
    return {};
  }
  OutputStream file(path);
  if (partial == Partial::kKept) file.keep();
  try {
    write(file);
  } catch (const std::exception&) {
    if (!file) file.finish();  // throws why nothing more could be written
    throw;
  }
  file.finish();
  if (const std::string sentence = other_name(file.made()); !sentence.empty()) std::cerr << sentence << '\n';
  return file.made().file();
}

}  // namespace farhand
