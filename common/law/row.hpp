// What an architecture says of itself beside its law: what it shows, and of which blocks it consists. Written down in
// its own file; architectures.cpp makes its row of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "common/law/law.hpp"
#include "common/law/params.hpp"

namespace farhand {

// One thing that a law shows, beside what every one does. What is not there is NaN.
struct LawSignal {
  std::string_view name;  // as in a recording: ends in its unit
  std::string_view unit;
  std::string_view meaning;
};

// What a scene may lack so that a block has nothing to do.
enum class Idle : std::uint8_t { kNever, kWithoutDelay, kWithoutContact };

struct LawBlock {
  std::string_view name;
  std::string_view why;      // it is there
  std::string_view without;  // what is so where it is not
  std::size_t bytes;
  std::array<std::string_view, 5> settings{};  // of a scene, read by nothing else: paths
  std::string_view asked_by = {};  // the setting, yes or no, by which a scene asks for it; else it is always there
  Idle idle = Idle::kNever;
  std::string_view touch = {};    // kWithoutContact: the setting of the torque, N m, below which it has nothing to do
  std::string_view instead = {};  // the architecture without it
  // Makes one and steps it over what a side saw, for what that costs. Returns something of each step.
  double (*run)(const LawParams& p, const FourChannelGains& K, double dt_s,
                std::span<const LawInputs<1>> seen) = nullptr;
};

template <class Step>
double sum_over(std::span<const LawInputs<1>> seen, Step&& step) {
  double sum = 0.0;
  for (const LawInputs<1>& in : seen) sum += step(in);
  return sum;
}

}  // namespace farhand
