#include <stdexcept>

#include "netem/lab/bare_law.hpp"
#include "netem/lab/plain_step.hpp"

namespace farhand {
namespace {

template <PlainScene kScene, class T>
class PlainLaw final : public BareLaw<T> {
 public:
  explicit PlainLaw(const ControlParams& p) : law_(p) {}

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
std::unique_ptr<BareLaw<T>> make_plain_law(std::string_view architecture, const ControlParams& params) {
  const std::string_view name = bare_law_of(architecture, Role::kLeader);
  if (name == "FOUR_CHANNEL_CDOB") return std::make_unique<PlainLaw<PlainScene::kCdob, T>>(params);
  if (name == "FOUR_CHANNEL_CDOB_SDCV") return std::make_unique<PlainLaw<PlainScene::kCdobSdcv, T>>(params);
  if (name == "MODEL_MEDIATED") throw std::invalid_argument("architecture MODEL_MEDIATED is written in double only");
  return std::make_unique<PlainLaw<PlainScene::kFourChannel, T>>(params);
}

template std::unique_ptr<BareLaw<double>> make_plain_law(std::string_view, const ControlParams&);
template std::unique_ptr<BareLaw<long double>> make_plain_law(std::string_view, const ControlParams&);

}  // namespace farhand
