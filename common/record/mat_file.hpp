// MAT level 4: little-endian matrices one after the other, each with a header of five 32-bit integers (type, rows,
// columns, whether complex, length of the name), its name with a zero byte, and its values column by column.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "common/record/mcap_format.hpp"

namespace farhand {

namespace mat {

// Decimal digits of the type: little endian, 0, kind of number, full or text.
inline constexpr std::uint32_t kDoubles = 0;
inline constexpr std::uint32_t kText = 51;  // 5: a byte each, 1: text

inline std::string header(std::uint32_t type, std::size_t rows, std::size_t columns, std::string_view name) {
  std::string bytes;
  mcap::put(bytes, type);
  mcap::put(bytes, static_cast<std::uint32_t>(rows));
  mcap::put(bytes, static_cast<std::uint32_t>(columns));
  mcap::put(bytes, std::uint32_t{0});  // not complex
  mcap::put(bytes, static_cast<std::uint32_t>(name.size() + 1));
  bytes.append(name);
  bytes.push_back('\0');
  return bytes;
}

inline void write_doubles(std::ostream& out, std::string_view name, const std::vector<std::vector<double>>& columns) {
  std::string bytes = header(kDoubles, columns.empty() ? 0 : columns.front().size(), columns.size(), name);
  for (const std::vector<double>& column : columns) {
    for (const double value : column) mcap::put(bytes, std::bit_cast<std::uint64_t>(value));
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.clear();
  }
}

// One row per line, the shorter ones filled up with spaces.
inline void write_text(std::ostream& out, std::string_view name, const std::vector<std::string>& lines) {
  std::size_t width = 0;
  for (const std::string& line : lines) width = std::max(width, line.size());
  std::string bytes = header(kText, lines.size(), width, name);
  for (std::size_t i = 0; i < width; ++i) {
    for (const std::string& line : lines) bytes.push_back(i < line.size() ? line[i] : ' ');
  }
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace mat

}  // namespace farhand
