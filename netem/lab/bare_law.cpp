#include "netem/lab/bare_law.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "common/law/architectures.hpp"
#include "common/station/drive.hpp"

namespace farhand {
namespace {

class BlockLaw final : public BareLaw<double> {
 public:
  BlockLaw(const LawMaker& maker, const ControlParams& p)
      : law_(maker.make(p.law, p.drive.K, p.drive.dt_s)), drive_(p.drive) {
    inputs_.engaged = true;
  }

  void reset(double x, const Sent<double>& received) noexcept override {
    drive_.reset({.x = Joints<1>(x)});
    inputs_.received = motion(received);
    law_->start(inputs_);
  }
  Sent<double> observe(double x) noexcept override {
    inputs_.local = drive_.observe({.x = Joints<1>(x)}, 1);
    return {inputs_.local.x[0], inputs_.local.v[0], inputs_.local.f[0]};
  }
  double follow(const Sent<double>& received) noexcept override {
    inputs_.received = motion(received);
    return drive_.follow(inputs_.local, law_->step(inputs_).follow, {}, 1).torque[0];
  }
  std::uint32_t limits() const noexcept override { return drive_.active_limits(); }

 private:
  static Motion<1> motion(const Sent<double>& sent) noexcept {
    return {Joints<1>(sent.x), Joints<1>(sent.v), Joints<1>(sent.f)};
  }

  std::unique_ptr<Law<1>> law_;
  DirectDrive<1> drive_;
  LawInputs<1> inputs_;
};

}  // namespace

std::string_view bare_law_of(std::string_view architecture, Role role) {
  constexpr std::array kKnown{"FOUR_CHANNEL", "FOUR_CHANNEL_CDOB", "FOUR_CHANNEL_CDOB_SDCV", "MODEL_MEDIATED"};
  if (std::ranges::find(kKnown, architecture) == kKnown.end()) throw std::invalid_argument(kNoBareLaw);
  return role == Role::kLeader ? architecture : kKnown[0];
}

std::unique_ptr<BareLaw<double>> make_block_law(std::string_view architecture, const ControlParams& params) {
  return std::make_unique<BlockLaw>(farhand::architecture(bare_law_of(architecture, Role::kLeader)).master, params);
}

}  // namespace farhand
