// The description of an architecture beside its law: the signals that it records and the blocks of which it consists.
// It stands in the file of the architecture; architectures.cpp makes the row from it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "common/law/law.hpp"
#include "common/law/params.hpp"

namespace farhand {

// One signal that a law records beside those of every law. An absent value is NaN.
struct LawSignal {
  std::string_view name;  // as in a recording: ends in its unit
  std::string_view unit;
  std::string_view meaning;
};

// The part whose absence from a scene leaves a block without effect.
enum class Idle : std::uint8_t { kNever, kWithoutDelay, kWithoutContact };

struct LawBlock {
  std::string_view name;
  std::string_view why;      // reason for the block
  std::string_view without;  // consequence of leaving it out
  std::size_t bytes;
  std::array<std::string_view, 5> settings{};  // paths in a scene that only this block reads
  std::string_view asked_by = {};  // yes-or-no setting by which a scene asks for the block; else it is always there
  Idle idle = Idle::kNever;
  std::string_view touch = {};    // kWithoutContact: setting of the torque, N m, below which it has no effect
  std::string_view instead = {};  // the architecture without it
  // Makes a block and steps it over recorded inputs of a side, to measure its time. Returns a sum over the steps, so
  // that no step is optimised away.
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
