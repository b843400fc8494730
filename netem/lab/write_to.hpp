// Where a command's results go.
#pragma once

#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <string>

#include "common/files/output_stream.hpp"

namespace farhand {

// "-" is standard output, nothing is nowhere, all else a new file (common/files/output.hpp); if its name is taken,
// stderr says which one it has got. Returns its name. Throws std::runtime_error when not all of it could be written.
// kept: what is written is of use by itself, and stays when the rest cannot be.
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
