#include "tests/lab/bare_law.hpp"

#include "common/scene/four_channel.hpp"
#include "tests/bench/plain_step.hpp"

namespace farhand {
namespace {

template <template <class> class Scene>
class BlockLaw final : public BareLaw<double> {
 public:
  explicit BlockLaw(const SceneParams& p) : scene_(p) {}

  void reset(double x) noexcept override {
    scene_.drive.reset({.x = Joints<1>(x)});
    scene_.start({Joints<1>(x), Joints<1>(0.0), Joints<1>(0.0)});
  }
  Sent<double> observe(double x) noexcept override {
    local_ = scene_.drive.observe({.x = Joints<1>(x)}, 1);
    return {local_.x[0], local_.v[0], local_.f[0]};
  }
  double follow(const Sent<double>& received) noexcept override {
    const Motion<1> remote{Joints<1>(received.x), Joints<1>(received.v), Joints<1>(received.f)};
    return scene_.drive.follow(local_, scene_.target(local_, remote), true, 1).torque[0];
  }

 private:
  Scene<DirectDrive<1>> scene_;
  Motion<1> local_;
};

template <PlainScene kScene, class T>
class PlainLaw final : public BareLaw<T> {
 public:
  explicit PlainLaw(const SceneParams& p) : law_(p) {}

  void reset(T x) noexcept override {
    law_.reset(x);
    law_.start(x, T{}, T{});
  }
  Sent<T> observe(T x) noexcept override {
    x_ = x;
    law_.observe(x);
    return {x, law_.v, law_.f};
  }
  T follow(const Sent<T>& received) noexcept override { return law_.follow(x_, received.x, received.v, received.f); }

 private:
  PlainStep<kScene, T> law_;
  T x_{};
};

}  // namespace

std::unique_ptr<BareLaw<double>> make_block_law(Architecture architecture, const SceneParams& params) {
  switch (architecture) {
    case Architecture::kCdob:
      return std::make_unique<BlockLaw<FourChannelCdob>>(params);
    case Architecture::kCdobSdcv:
      return std::make_unique<BlockLaw<FourChannelCdobSdcv>>(params);
    case Architecture::kFourChannel:
      break;
  }
  return std::make_unique<BlockLaw<FourChannel>>(params);
}

template <class T>
std::unique_ptr<BareLaw<T>> make_plain_law(Architecture architecture, const SceneParams& params) {
  switch (architecture) {
    case Architecture::kCdob:
      return std::make_unique<PlainLaw<PlainScene::kCdob, T>>(params);
    case Architecture::kCdobSdcv:
      return std::make_unique<PlainLaw<PlainScene::kCdobSdcv, T>>(params);
    case Architecture::kFourChannel:
      break;
  }
  return std::make_unique<PlainLaw<PlainScene::kFourChannel, T>>(params);
}

template std::unique_ptr<BareLaw<long double>> make_plain_law(Architecture, const SceneParams&);

}  // namespace farhand
