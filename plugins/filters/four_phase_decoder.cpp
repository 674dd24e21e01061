// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Four-phase decoding: distance, amplitude, intensity, sigma and flags from the samples of one modulation period.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/four_phase_decoder.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <tofgraph/physics/vector_phase.hpp>

#include <array>

#include "plugins/filters/decoder.hpp"
#include "plugins/filters/decoder_vector.hpp"

#ifndef TOFGRAPH_FOUR_PHASE_DECODER_ONCE
#define TOFGRAPH_FOUR_PHASE_DECODER_ONCE
namespace tofgraph {

/// Constants of all pixels of a frame.
struct DecoderSettings {
  DecoderCounts counts;
  std::array<std::size_t, 4> order;        // indices of the images at 0, 90, 180, 270 degrees
  float metres_per_radian, range;          // m/rad, m
  float null2_square, null2_per_variance;  // inconsistent: N2^2 > null2_square + null2_per_variance variance
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Decodes a vector of pixels starting at pixel i. `Taps`: T is the type of the taps, else of the phases.
template <bool Taps, class T, class D>
HWY_INLINE void DecodeAt(D d, const DecoderSettings& s, const DecoderImages& images, std::size_t i) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const T* from = static_cast<const T*>(images.samples) + i;
  V c[4];
  TapSums<D> sums{hn::Zero(di), hn::Zero(du16)};
  for (std::size_t k = 0; k < 4; ++k) {
    if constexpr (Taps)
      c[k] = LoadTaps(d, from + 2 * s.order[k] * images.pixels, images.pixels, sums);
    else
      c[k] = LoadFloat(d, from + s.order[k] * images.pixels);
  }
  const V sine = hn::Sub(c[3], c[1]), cosine = hn::Sub(c[0], c[2]);
  const V amplitude = hn::Mul(hn::Set(d, 0.5F), hn::Sqrt(hn::MulAdd(sine, sine, hn::Mul(cosine, cosine))));
  const V intensity = Taps ? hn::Mul(hn::ConvertTo(d, sums.sum), hn::Set(d, 0.125F))
                           : hn::Mul(amplitude, hn::Set(d, s.counts.intensity_per_amplitude));
  const V tap_variance = hn::MulAdd(hn::Set(d, s.counts.shot_noise), intensity, hn::Set(d, s.counts.read_variance));
  const V null2 = hn::Mul(hn::Set(d, 0.25F), hn::Sub(hn::Add(c[0], c[2]), hn::Add(c[1], c[3])));
  const V limit = hn::MulAdd(hn::Set(d, s.null2_per_variance), tap_variance, hn::Set(d, s.null2_square));

  Pixels<D> pixels{
      LoadFlags(d, images.flags + i),
      physics::HWY_NAMESPACE::WrappedDistance(d, sine, cosine, hn::Set(d, s.metres_per_radian), hn::Set(d, s.range)),
      amplitude, intensity,
      // Without light, or with NaN samples, there is no phase.
      hn::And(hn::Gt(amplitude, hn::Zero(d)), hn::Lt(amplitude, hn::Set(d, hwy::HighestValue<float>())))};
  Raise(d, pixels.flags, hn::Gt(hn::Mul(null2, null2), limit), flag::inconsistent);
  const auto valid = StorePixels<Taps>(d, s.counts, images, i, sums, pixels);
  if (images.sigma != nullptr) {
    const V phase_sigma = hn::Div(hn::Sqrt(tap_variance), amplitude);
    hn::StoreU(hn::IfThenElse(valid, hn::Mul(hn::Set(d, s.metres_per_radian), phase_sigma), hn::NaN(d)), d,
               images.sigma + i);
  }
}

template <bool Taps, class T>
void DecodeAll(const DecoderSettings settings, const DecoderImages images) {  // copies, which no store can alias
  const hn::ScalableTag<float> d;
  const hn::CappedTag<float, 1> one;
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= images.pixels; i += hn::Lanes(d)) DecodeAt<Taps, T>(d, settings, images, i);
  for (; i < images.pixels; ++i) DecodeAt<Taps, T>(one, settings, images, i);
}

void Decode(const DecoderSettings& settings, const DecoderImages& images) {
  switch (images.type) {
    case TOFGRAPH_TYPE_U16:
      return DecodeAll<true, std::uint16_t>(settings, images);
    case TOFGRAPH_TYPE_I16:
      return DecodeAll<false, std::int16_t>(settings, images);
    case TOFGRAPH_TYPE_I32:
      return DecodeAll<false, std::int32_t>(settings, images);
    default:
      return DecodeAll<false, float>(settings, images);
  }
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Decode);

/// sigma_D = c / (4 pi f_mod) * sqrt(variance of c_k / 2) / amplitude.
struct FourPhaseDecoder final : Decoder {
  static constexpr bool steady = true;
  Param<double> inconsistent_above{this,
                                   "inconsistent_above",
                                   {.unit = "counts",
                                    .default_value = "auto",
                                    .min = 0,
                                    .choices = "auto off",
                                    .text = "flags |N2| = |c0 - c1 + c2 - c3| / 4 above this as inconsistent; "
                                            "auto: five standard deviations where the noise is known, else off"}};

  void prepare(Setup& setup) {
    prepare_samples(setup);
    const std::vector<std::size_t> order = physics::quarter_order(exposures_);
    if (order.empty()) {
      throw std::runtime_error(
          "decodes four exposures at 0, 90, 180 and 270 deg of one frequency, in any order; the input has " +
          physics::exposures_text(exposures_) + ": use phase_decoder for it");
    }
    set_constants(order);
  }

  void process(Frame& frame) const {
    const double frequency = pass_on_frequency(frame);
    DecoderSettings settings = settings_;
    settings.metres_per_radian = static_cast<float>(physics::metres_per_radian(frequency));
    settings.range = static_cast<float>(physics::unambiguous_range(frequency));
    decode_frame(frame, [&](const DecoderImages& images) { HWY_DYNAMIC_DISPATCH(Decode)(settings, images); });
  }

 private:
  /// Constants that do not depend on the frame.
  void set_constants(const std::vector<std::size_t>& order) {
    constexpr double never = std::numeric_limits<float>::infinity();
    const bool automatic = inconsistent_above.keyword() == "auto" && counts_.noise_known;
    settings_ = {.counts = counts_,
                 .null2_square =
                     static_cast<float>(inconsistent_above.keyword().empty() ? *inconsistent_above * *inconsistent_above
                                        : automatic                          ? 0
                                                                             : never),
                 // N2 is a quarter of the sum of four samples of two taps each: its variance is half that of a tap
                 .null2_per_variance = automatic ? 25.0F / 2 : 0.0F};
    std::ranges::copy(order, settings_.order.begin());
  }

  DecoderSettings settings_{};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::FourPhaseDecoder, "Distance, amplitude, intensity, sigma and flags from four-phase samples")
#endif
