// Scaling-down compensation value: full CDOB compensation in free motion, none in contact.
//
//   alpha = 1 for |f_s| <= f_1, 0 for |f_s| >= f_2, linear in between      (Daud 2011, 5.17; there without the modulus)
//
// Compensation improves operability in free motion and costs force in contact. f_1 is the friction of the slave; f_2
// depends on the patient. Unfiltered, alpha limit-cycles between f_1 and f_2, because releasing the compensation
// changes f_s.
#pragma once

#include "common/law/params.hpp"
#include "common/signal/low_pass.hpp"

namespace farhand {

template <int N>
class Sdcv {
 public:
  Sdcv(const SdcvParams& params, double dt_s)
      : f_1_(Joints<N>::Constant(params.f_1)),
        f_2_(Joints<N>::Constant(params.f_2)),
        filter_(params.alpha_cutoff, dt_s) {
    filter_.reset(Joints<N>::Ones());
  }

  // Thresholds of joint j, N m; f_1 below f_2.
  void set_thresholds(int j, double f_1, double f_2) noexcept { f_1_[j] = f_1, f_2_[j] = f_2; }

  // alpha before the low-pass.
  Joints<N> raw(const Joints<N>& f_s) const noexcept { return ((f_2_ - f_s.abs()) / (f_2_ - f_1_)).max(0.0).min(1.0); }

  const Joints<N>& step(const Joints<N>& f_s) noexcept { return filter_.step(raw(f_s)); }
  void reset(const Joints<N>& f_s) noexcept { filter_.reset(raw(f_s)); }
  const Joints<N>& value() const noexcept { return filter_.value(); }

 private:
  Joints<N> f_1_, f_2_;
  LowPass<N> filter_;
};

}  // namespace farhand
