#include "netem/lab/bare_law.hpp"

#include <stdexcept>

#include "common/scene/four_channel.hpp"

namespace farhand {
namespace {

template <template <class> class Scene>
class BlockLaw final : public BareLaw<double> {
 public:
  explicit BlockLaw(const SceneParams& p) : scene_(p) {}

  void reset(double x, const Sent<double>& received) noexcept override {
    scene_.drive.reset({.x = Joints<1>(x)});
    scene_.start({}, motion(received));
  }
  Sent<double> observe(double x) noexcept override {
    local_ = scene_.drive.observe({.x = Joints<1>(x)}, 1);
    return {local_.x[0], local_.v[0], local_.f[0]};
  }
  double follow(const Sent<double>& received) noexcept override {
    return scene_.drive.follow(local_, scene_.target(local_, motion(received), {}), true, 1).torque[0];
  }
  std::uint32_t limits() const noexcept override { return scene_.drive.active_limits(); }

 private:
  static Motion<1> motion(const Sent<double>& sent) noexcept {
    return {Joints<1>(sent.x), Joints<1>(sent.v), Joints<1>(sent.f)};
  }

  Scene<DirectDrive<1>> scene_;
  Motion<1> local_;
};

}  // namespace

std::unique_ptr<BareLaw<double>> make_block_law(Architecture architecture, const SceneParams& params) {
  switch (architecture) {
    case Architecture::kCdob:
      return std::make_unique<BlockLaw<FourChannelCdob>>(params);
    case Architecture::kCdobSdcv:
      return std::make_unique<BlockLaw<FourChannelCdobSdcv>>(params);
    case Architecture::kMediated:
      return std::make_unique<BlockLaw<FourChannelMediated>>(params);
    case Architecture::kFourChannel:
      return std::make_unique<BlockLaw<FourChannel>>(params);
    default:
      throw std::invalid_argument(kNoBareLaw);
  }
}

}  // namespace farhand
