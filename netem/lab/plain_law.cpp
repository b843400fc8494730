#include <stdexcept>

#include "netem/lab/bare_law.hpp"
#include "netem/lab/plain_step.hpp"

namespace farhand {
namespace {

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

template <class T>
std::unique_ptr<BareLaw<T>> make_plain_law(Architecture architecture, const SceneParams& params) {
  switch (architecture) {
    case Architecture::kCdob:
      return std::make_unique<PlainLaw<PlainScene::kCdob, T>>(params);
    case Architecture::kCdobSdcv:
      return std::make_unique<PlainLaw<PlainScene::kCdobSdcv, T>>(params);
    case Architecture::kMediated:
      throw std::invalid_argument("architecture MODEL_MEDIATED is written in double only");
    case Architecture::kFourChannel:
      return std::make_unique<PlainLaw<PlainScene::kFourChannel, T>>(params);
    default:
      throw std::invalid_argument(kNoBareLaw);
  }
}

template std::unique_ptr<BareLaw<double>> make_plain_law(Architecture, const SceneParams&);
template std::unique_ptr<BareLaw<long double>> make_plain_law(Architecture, const SceneParams&);

}  // namespace farhand
