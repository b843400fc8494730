#include "tests/lab/bare_law.hpp"

#include "common/scene/four_channel.hpp"
#include "tests/bench/plain_step.hpp"

namespace farhand {
namespace {

template <template <class> class Scene>
class BlockLaw final : public BareLaw<double> {
 public:
  explicit BlockLaw(const SceneParams& p) : scene_(p) {}

  void reset(double x, const Sent<double>& received) noexcept override {
    scene_.drive.reset({.x = Joints<1>(x)});
    scene_.start(motion(received));
  }
  Sent<double> observe(double x) noexcept override {
    local_ = scene_.drive.observe({.x = Joints<1>(x)}, 1);
    return {local_.x[0], local_.v[0], local_.f[0]};
  }
  double follow(const Sent<double>& received) noexcept override {
    return scene_.drive.follow(local_, scene_.target(local_, motion(received)), true, 1).torque[0];
  }
  std::uint32_t limits() const noexcept override { return scene_.drive.active_limits(); }

 private:
  static Motion<1> motion(const Sent<double>& sent) noexcept {
    return {Joints<1>(sent.x), Joints<1>(sent.v), Joints<1>(sent.f)};
  }

  Scene<DirectDrive<1>> scene_;
  Motion<1> local_;
};

template <PlainScene kScene, class T>
class PlainLaw final : public BareLaw<T> {
 public:
  explicit PlainLaw(const SceneParams& p) : law_(p) {}

  void reset(T x, const Sent<T>& received) noexcept override {
    law_.reset(x);
    law_.start(received.x, received.v, received.f);
  }
  Sent<T> observe(T x) noexcept override {
    x_ = x;
    law_.observe(x);
    return {x, law_.v, law_.f};
  }
  T follow(const Sent<T>& received) noexcept override { return law_.follow(x_, received.x, received.v, received.f); }
  std::uint32_t limits() const noexcept override { return law_.limits; }

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

template std::unique_ptr<BareLaw<double>> make_plain_law(Architecture, const SceneParams&);
template std::unique_ptr<BareLaw<long double>> make_plain_law(Architecture, const SceneParams&);

}  // namespace farhand
