// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Decoding of any exposures: three or more steps at up to three modulation frequencies, unwrapped.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/phase_decoder.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <tofgraph/physics/vector_phase.hpp>

#include <array>

#include "plugins/filters/decoder.hpp"
#include "plugins/filters/decoder_vector.hpp"

#ifndef TOFGRAPH_PHASE_DECODER_ONCE
#define TOFGRAPH_PHASE_DECODER_ONCE
namespace tofgraph {

constexpr std::size_t max_bands = 3;

/// The exposures of one frequency; see physics::PhaseFit. The rows of what the fit leaves are one after the other.
struct Band {
  std::vector<std::size_t> image;
  std::vector<float> cosine, sine, rest;
  float xx, xy, yy;
};

/// What is the same for all pixels of a frame.
struct PhaseSettings {
  std::array<float, max_bands> metres_per_radian, range, inverse_range;  // of each band, lowest frequency first
  DecoderCounts counts;
  float any_variance;                // of a sample, where the noise is not known: weights need a scale
  float phase_variance;              // rad^2, of systematic errors
  float wrapped_below;               // chi-square between the best and the second best wraps
  float steepest;                    // rad^2: no wrap can be told with more variance of the phase
  float rest_above, disagree_above;  // chi-square of the samples' rest, and of the frequencies
  float wrong_above;                 // of the frequencies: none of the wraps within max_range is right
  int first_wrap, last_wrap;         // of the highest frequency
  float repeat;                      // m: distances repeat; 0: where max_range ends them
  float max_range, margin;           // m, standard deviations; infinity: none
  float intensity_scale;             // 1 / number of taps
  float each;                        // 1 / number of bands
  const Band* bands;
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// The most likely distance; see physics::Unwrapping, which is the same in double.
template <class D, class V = hn::Vec<D>> struct Likeliest { V distance, cost, second; };

template <std::size_t Bands, class D, class V = hn::Vec<D>>
HWY_INLINE Likeliest<D> Unwrap(D d, const PhaseSettings& s, const V* distances, const V* weights, V inverse_sum) {
  const V never = hn::Set(d, hwy::HighestValue<float>());
  Likeliest<D> result{hn::NaN(d), never, never};
  for (int wrap = s.first_wrap; wrap <= s.last_wrap; ++wrap) {
    const V reference =
        hn::MulAdd(hn::Set(d, static_cast<float>(wrap)), hn::Set(d, s.range[Bands - 1]), distances[Bands - 1]);
    V first = hn::Zero(d), square = hn::Zero(d);
    for (std::size_t b = 0; b + 1 < Bands; ++b) {
      const V away = hn::Sub(distances[b], reference);
      const V wraps = hn::Round(hn::Mul(away, hn::Set(d, s.inverse_range[b])));
      const V rest = hn::NegMulAdd(wraps, hn::Set(d, s.range[b]), away);
      const V weighted = hn::Mul(weights[b], rest);
      first = hn::Add(first, weighted);
      square = hn::MulAdd(weighted, rest, square);
    }
    const V shift = hn::Mul(first, inverse_sum);
    const V cost = hn::NegMulAdd(first, shift, square);
    result.second = hn::Min(result.second, hn::Max(result.cost, cost));
    result.distance = hn::IfThenElse(hn::Lt(cost, result.cost), hn::Add(reference, shift), result.distance);
    result.cost = hn::Min(result.cost, cost);
  }
  return result;
}

/// One vector of pixels, beginning at pixel i. `Taps`: T is the type of the taps, else of the phases.
template <std::size_t Bands, bool Taps, class T, class D>
HWY_INLINE void DecodeAt(D d, const PhaseSettings& s, const DecoderImages& images, std::size_t i) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const T* from = static_cast<const T*>(images.samples) + i;
  TapSums<D> sums{hn::Zero(di), hn::Zero(du16)};
  V x[Bands], y[Bands], square[Bands];
  V amplitude = hn::Zero(d), rest = hn::Zero(d);
  for (std::size_t b = 0; b < Bands; ++b) {
    const Band& band = s.bands[b];
    const std::size_t count = band.image.size();
    V c[physics::max_exposures];
    x[b] = y[b] = hn::Zero(d);
    for (std::size_t j = 0; j < count; ++j) {
      if constexpr (Taps)
        c[j] = LoadTaps(d, from + 2 * band.image[j] * images.pixels, images.pixels, sums);
      else
        c[j] = LoadFloat(d, from + band.image[j] * images.pixels);
      x[b] = hn::MulAdd(hn::Set(d, band.cosine[j]), c[j], x[b]);
      y[b] = hn::MulAdd(hn::Set(d, band.sine[j]), c[j], y[b]);
    }
    for (std::size_t r = 0; r < band.rest.size(); r += count) {
      V along = hn::Zero(d);
      for (std::size_t j = 0; j < count; ++j) along = hn::MulAdd(hn::Set(d, band.rest[r + j]), c[j], along);
      rest = hn::MulAdd(along, along, rest);
    }
    square[b] = hn::MulAdd(x[b], x[b], hn::Mul(y[b], y[b]));
    amplitude = hn::Add(amplitude, hn::Sqrt(square[b]));
  }
  amplitude = hn::Mul(amplitude, hn::Set(d, s.each));
  const V intensity = Taps ? hn::Mul(hn::ConvertTo(d, sums.sum), hn::Set(d, s.intensity_scale))
                           : hn::Mul(amplitude, hn::Set(d, s.counts.intensity_per_amplitude));
  const V tap_variance = hn::MulAdd(hn::Set(d, s.counts.shot_noise), intensity, hn::Set(d, s.counts.read_variance));
  const V variance = hn::MulAdd(hn::Set(d, 2.0F), tap_variance, hn::Set(d, s.any_variance));

  auto flags = LoadFlags(d, images.flags + i);
  V distances[Bands], weights[Bands], noises[Bands];
  V sum = hn::Zero(d), steepest = hn::Zero(d);
  for (std::size_t b = 0; b < Bands; ++b) {
    const Band& band = s.bands[b];
    const V scale = hn::Set(d, s.metres_per_radian[b]);
    distances[b] = physics::HWY_NAMESPACE::WrappedDistance(d, y[b], x[b], scale, hn::Set(d, s.range[b]));
    // Variance of atan2(y, x).
    const V across = hn::MulAdd(
        hn::Mul(x[b], x[b]), hn::Set(d, band.yy),
        hn::NegMulAdd(hn::Mul(x[b], y[b]), hn::Set(d, 2 * band.xy), hn::Mul(hn::Mul(y[b], y[b]), hn::Set(d, band.xx))));
    const V of_phase = hn::Div(hn::Mul(variance, across), hn::Mul(square[b], square[b]));
    const V scale2 = hn::Mul(scale, scale);
    noises[b] = hn::Mul(scale2, of_phase);
    steepest = hn::Max(steepest, of_phase);
    if constexpr (Bands > 1) {
      weights[b] = hn::Div(hn::Set(d, 1.0F), hn::Mul(scale2, hn::Add(of_phase, hn::Set(d, s.phase_variance))));
      sum = hn::Add(sum, weights[b]);
    }
  }
  V distance = distances[0], noise = noises[0];
  if constexpr (Bands > 1) {
    const V inverse = hn::Div(hn::Set(d, 1.0F), sum);
    const Likeliest<D> best = Unwrap<Bands>(d, s, distances, weights, inverse);
    distance = best.distance;
    const V repeat = hn::Set(d, s.repeat);
    if (s.repeat > 0) {
      distance = hn::IfThenElse(hn::Lt(distance, hn::Zero(d)), hn::Add(distance, repeat), distance);
      distance = hn::IfThenElse(hn::Ge(distance, repeat), hn::Sub(distance, repeat), distance);
    }
    noise = hn::Zero(d);
    for (std::size_t b = 0; b < Bands; ++b) {
      const V share = hn::Mul(weights[b], inverse);
      noise = hn::MulAdd(hn::Mul(share, share), noises[b], noise);
    }
    const auto near = hn::Lt(hn::Sub(best.second, best.cost), hn::Set(d, s.wrapped_below));
    Raise(d, flags, hn::Or(near, hn::Gt(steepest, hn::Set(d, s.steepest))), flag::wrapped);
    const V beyond = hn::Max(hn::Neg(distance), hn::Sub(distance, hn::Set(d, s.max_range)));
    Raise(d, flags, hn::Gt(beyond, hn::Mul(hn::Set(d, s.margin), hn::Sqrt(noise))), flag::wrapped);
    Raise(d, flags, hn::Gt(best.cost, hn::Set(d, s.wrong_above)), flag::wrapped);
    Raise(d, flags, hn::Gt(best.cost, hn::Set(d, s.disagree_above)), flag::inconsistent);
  }
  Raise(d, flags, hn::Gt(rest, hn::Mul(variance, hn::Set(d, s.rest_above))), flag::inconsistent);
  // Without light, or with samples that are not numbers, there is no phase.
  auto measured = hn::Lt(amplitude, hn::Set(d, hwy::HighestValue<float>()));
  for (std::size_t b = 0; b < Bands; ++b) measured = hn::And(measured, hn::Gt(square[b], hn::Zero(d)));
  measured = hn::And(measured, hn::Lt(hn::Abs(distance), hn::Set(d, hwy::HighestValue<float>())));
  const auto valid =
      StorePixels<Taps>(d, s.counts, images, i, sums, Pixels<D>{flags, distance, amplitude, intensity, measured});
  if (images.sigma != nullptr) hn::StoreU(hn::IfThenElse(valid, hn::Sqrt(noise), hn::NaN(d)), d, images.sigma + i);
}

template <std::size_t Bands, bool Taps, class T>
void DecodeAll(const PhaseSettings settings, const DecoderImages images) {  // copies: no store can change them
  const hn::ScalableTag<float> d;
  const hn::CappedTag<float, 1> one;
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= images.pixels; i += hn::Lanes(d)) DecodeAt<Bands, Taps, T>(d, settings, images, i);
  for (; i < images.pixels; ++i) DecodeAt<Bands, Taps, T>(one, settings, images, i);
}

template <std::size_t Bands> void DecodeType(const PhaseSettings& settings, const DecoderImages& images) {
  switch (images.type) {
    case TOFGRAPH_TYPE_U16:
      return DecodeAll<Bands, true, std::uint16_t>(settings, images);
    case TOFGRAPH_TYPE_I16:
      return DecodeAll<Bands, false, std::int16_t>(settings, images);
    case TOFGRAPH_TYPE_I32:
      return DecodeAll<Bands, false, std::int32_t>(settings, images);
    default:
      return DecodeAll<Bands, false, float>(settings, images);
  }
}

void DecodePhases(const PhaseSettings& settings, const DecoderImages& images, std::size_t bands) {
  if (bands == 1) return DecodeType<1>(settings, images);
  if (bands == 2) return DecodeType<2>(settings, images);
  return DecodeType<3>(settings, images);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <boost/math/distributions/chi_squared.hpp>

namespace tofgraph {

HWY_EXPORT(DecodePhases);

/// The phase of each frequency is its samples' linear least squares with a free offset. Of several frequencies the
/// distance is the most likely one over all wraps, each frequency weighted by the variance of its phase: the closest
/// point of a lattice, as for Droeschel, Holz, Behnke (Multi-frequency phase unwrapping for time-of-flight cameras,
/// IROS 2010) and Crabb, Manduchi (Fast single-frequency time-of-flight range imaging, CVPRW 2015), here without their
/// smoothness between pixels. amplitude is the mean of the frequencies.
struct PhaseDecoder final : Decoder {
  Param<double> inconsistent_above{
      this,
      "inconsistent_above",
      {.default_value = "5",
       .min = 0,
       .choices = "off",
       .text = "standard deviations: samples or frequencies that fit each other less are flagged as inconsistent; "
               "where the noise is known"}};
  Param<double> wrap_confidence{
      this,
      "wrap_confidence",
      {.default_value = "0.999",
       .min = 0.5,
       .max = 0.999999,
       .text = "of the best wraps against the second best ones; less is flagged as wrapped; where the noise is known"}};
  Param<bool> invalidate_wrapped{
      this, "invalidate_wrapped", {.default_value = "true", .text = "pixels whose wraps are uncertain become invalid"}};
  Param<double> phase_error{this,
                            "phase_error",
                            {.unit = "rad",
                             .default_value = "0 rad",
                             .min = 0,
                             .max = 1,
                             .text = "standard deviation of systematic errors of each frequency's phase, which the "
                                     "choice of the wraps allows for; sigma is without it"}};
  Param<double> max_range{
      this,
      "max_range",
      {.unit = "m",
       .min = 1e-3,
       .max = 1e6,
       .text = "nothing is farther away; default: where the frequencies repeat together, c / (2 gcd)"}};

  void prepare(Setup& setup) {
    prepare_samples(setup);
    if (const std::string problem = physics::exposures_problem(exposures_); !problem.empty())
      throw std::runtime_error("cannot decode what arrives: " + problem);
    fits_ = physics::phase_fits(exposures_);
    if (fits_.size() > max_bands)
      throw std::runtime_error("takes up to three modulation frequencies; what arrives has " +
                               physics::exposures_text(exposures_));
    if (fits_.size() > 1 && modulation_frequency.given())
      throw ConfigError("modulation_frequency",
                        "is that of one frequency; what arrives has " + physics::exposures_text(exposures_));
    if (fits_.size() == 1) refuse_what_unwraps();
    if (*phase_error > 0 && !counts_.noise_known)
      throw ConfigError("phase_error",
                        "adds to the noise, which is not known: give read_noise and shot_noise, here or "
                        "in the camera's profile");
    for (const physics::PhaseFit& fit : fits_) add_band(fit);
    set_constants();
    if (fits_.size() > 1) set_ranges();
  }

  void process(Frame& frame) const {
    PhaseSettings settings = settings_;
    if (bands_.size() == 1) set_frequency(settings, 0, frequency_of(frame));
    decode_frame(frame, [&](const DecoderImages& images) {
      HWY_DYNAMIC_DISPATCH(DecodePhases)(settings, images, bands_.size());
    });
  }

 private:
  void refuse_what_unwraps() const {
    for (const detail::ParamBase* parameter : std::initializer_list<const detail::ParamBase*>{
             &wrap_confidence, &invalidate_wrapped, &phase_error, &max_range})
      if (parameter->given())
        throw ConfigError(parameter->parameter().name, "is for several modulation frequencies; what arrives has " +
                                                           physics::exposures_text(exposures_));
  }

  void add_band(const physics::PhaseFit& fit) {
    Band band{.image = fit.image,
              .cosine = {fit.cosine.begin(), fit.cosine.end()},
              .sine = {fit.sine.begin(), fit.sine.end()},
              .rest = {},
              .xx = static_cast<float>(fit.xx),
              .xy = static_cast<float>(fit.xy),
              .yy = static_cast<float>(fit.yy)};
    for (const std::vector<double>& row : fit.rest) band.rest.insert(band.rest.end(), row.begin(), row.end());
    bands_.push_back(std::move(band));
  }

  static void set_frequency(PhaseSettings& settings, std::size_t band, double frequency) {
    settings.metres_per_radian[band] = static_cast<float>(physics::metres_per_radian(frequency));
    settings.range[band] = static_cast<float>(physics::unambiguous_range(frequency));
    settings.inverse_range[band] = static_cast<float>(1 / physics::unambiguous_range(frequency));
  }

  /// Chi-square of so many degrees of freedom that good samples exceed as seldom as a normal number so many standard
  /// deviations to either side.
  static double chi_square(std::size_t freedom, double deviations) {
    if (freedom == 0) return std::numeric_limits<float>::infinity();
    const double share = std::erfc(deviations / std::sqrt(2.0));
    if (share < 1e-300) return std::numeric_limits<float>::infinity();
    const boost::math::chi_squared distribution(static_cast<double>(freedom));
    return boost::math::quantile(boost::math::complement(distribution, share));
  }

  void set_constants() {
    constexpr float never = std::numeric_limits<float>::infinity();
    std::size_t freedom = 0;
    for (const physics::PhaseFit& fit : fits_) freedom += fit.rest.size();
    const bool known = counts_.noise_known && (counts_.read_variance > 0 || counts_.shot_noise > 0);
    const bool judged = known && inconsistent_above.keyword().empty();
    counts_.invalid_flags |= *invalidate_wrapped ? flag::wrapped : 0;
    settings_ = {
        .counts = counts_,
        .any_variance = known ? 0.0F : 1.0F,
        .phase_variance = static_cast<float>(*phase_error * *phase_error),
        .wrapped_below = known ? static_cast<float>(2 * std::log(*wrap_confidence / (1 - *wrap_confidence))) : -1.0F,
        .steepest = known ? 0.36F : never,  // 0.6 rad: half a turn is five standard deviations
        .rest_above = judged ? static_cast<float>(chi_square(freedom, *inconsistent_above)) : never,
        .disagree_above = judged ? static_cast<float>(chi_square(fits_.size() - 1, *inconsistent_above)) : never,
        .wrong_above = never,
        .first_wrap = 0,
        .last_wrap = 0,
        .repeat = 0,
        .max_range = never,
        .margin = known ? 5.0F : 0.0F,
        .intensity_scale = static_cast<float>(0.5 / static_cast<double>(exposures_.size())),
        .each = static_cast<float>(1.0 / static_cast<double>(fits_.size())),
        .bands = bands_.data()};
  }

  void set_ranges() {
    std::vector<double> frequencies;
    for (const physics::PhaseFit& fit : fits_) {
      set_frequency(settings_, frequencies.size(), fit.frequency);
      frequencies.push_back(fit.frequency);
    }
    if (physics::common_frequency(frequencies) == 0 && !max_range.given()) {
      throw ConfigError("max_range",
                        "the modulation frequencies have no common range: " + physics::exposures_text(exposures_) +
                            ", so it has to be given, e.g. max_range: 20 m");
    }
    const physics::Unwrapping unwrapping(frequencies,
                                         max_range.given() ? *max_range : std::numeric_limits<double>::infinity());
    constexpr long most = 256;
    if (unwrapping.last() > most) {
      throw ConfigError("max_range", "the frequencies repeat after " + physics::short_number(unwrapping.repeat()) +
                                         " m, and up to " + physics::short_number(unwrapping.range()) +
                                         " m the highest has " + std::to_string(unwrapping.last()) +
                                         " wraps, more than " + std::to_string(most) +
                                         ": give a smaller one, e.g. max_range: 20 m");
    }
    settings_.first_wrap = static_cast<int>(unwrapping.first());
    settings_.last_wrap = static_cast<int>(unwrapping.last());
    if (unwrapping.cyclic()) {
      settings_.repeat = static_cast<float>(unwrapping.repeat());
      return;
    }
    settings_.max_range = static_cast<float>(*max_range);
    if (settings_.any_variance == 0) settings_.wrong_above = static_cast<float>(chi_square(fits_.size() - 1, 5));
  }

  std::vector<physics::PhaseFit> fits_;
  std::vector<Band> bands_;
  PhaseSettings settings_{};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PhaseDecoder, "Distance, amplitude, intensity, sigma and flags from any exposures, unwrapped")
#endif
