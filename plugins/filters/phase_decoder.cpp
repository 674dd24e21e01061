// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Decoder for arbitrary exposures: three or more steps at up to three modulation frequencies, unwrapped.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/phase_decoder.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include "plugins/filters/decoder.hpp"
#include "plugins/filters/phase_settings.hpp"
#include "plugins/filters/phase_vector.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <std::size_t Bands, bool Taps, class T>
void DecodeAll(const PhaseSettings settings, const DecoderImages images) {  // copies, which no store can alias
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

/// The phase of each frequency is the linear least-squares fit to its samples, with a free offset. With several
/// frequencies the distance is the most likely one over all wraps, each frequency weighted by the variance of its
/// phase: the closest point of a lattice, as for Droeschel, Holz, Behnke (Multi-frequency phase unwrapping for
/// time-of-flight cameras, IROS 2010) and Crabb, Manduchi (Fast single-frequency time-of-flight range imaging, CVPRW
/// 2015), here without their smoothness between pixels. amplitude is the mean of the frequencies.
struct PhaseDecoder final : Decoder {
  Param<double> inconsistent_above{
      this,
      "inconsistent_above",
      {.default_value = "5",
       .min = 0,
       .choices = "off",
       .text = "in standard deviations: samples or frequencies that differ by more are flagged as inconsistent; "
               "where the noise is known"}};
  Param<double> wrap_confidence{this,
                                "wrap_confidence",
                                {.default_value = "0.999",
                                 .min = 0.5,
                                 .max = 0.999999,
                                 .text = "confidence of the best wraps over the second best; a smaller one is flagged "
                                         "as wrapped; if the noise is known"}};
  Param<bool> invalidate_wrapped{
      this, "invalidate_wrapped", {.default_value = "true", .text = "pixels whose wraps are uncertain become invalid"}};
  Param<double> phase_error{this,
                            "phase_error",
                            {.unit = "rad",
                             .default_value = "0 rad",
                             .min = 0,
                             .max = 1,
                             .text = "standard deviation of systematic errors of each frequency's phase, which the "
                                     "choice of the wraps allows for; not included in sigma"}};
  Param<double> max_range{
      this,
      "max_range",
      {.unit = "m",
       .min = 1e-3,
       .max = 1e6,
       .text = "maximum distance; default: the distance at which the frequencies repeat together, c / (2 gcd)"}};

  void prepare(Setup& setup) {
    prepare_samples(setup);
    if (const std::string problem = physics::exposures_problem(exposures_); !problem.empty())
      throw std::runtime_error("cannot decode the input: " + problem);
    fits_ = physics::phase_fits(exposures_);
    if (fits_.size() > max_bands)
      throw std::runtime_error("takes up to three modulation frequencies; the input has " +
                               physics::exposures_text(exposures_));
    if (fits_.size() > 1 && modulation_frequency.given())
      throw ConfigError("modulation_frequency",
                        "applies to one frequency; the input has " + physics::exposures_text(exposures_));
    if (fits_.size() == 1) refuse_what_unwraps();
    if (*phase_error > 0 && !counts_.noise_known)
      throw ConfigError("phase_error",
                        "is added to the noise, which is unknown: give read_noise and shot_noise, here or "
                        "in the camera's profile");
    for (const physics::PhaseFit& fit : fits_) add_band(fit);
    set_constants();
    if (fits_.size() > 1) set_ranges();
  }

  void process(Frame& frame) const {
    PhaseSettings settings = settings_;
    if (bands_.size() == 1) set_frequency(settings, 0, pass_on_frequency(frame));
    decode_frame(frame, [&](const DecoderImages& images) {
      HWY_DYNAMIC_DISPATCH(DecodePhases)(settings, images, bands_.size());
    });
  }

 private:
  void refuse_what_unwraps() const {
    for (const detail::ParamBase* parameter : std::initializer_list<const detail::ParamBase*>{
             &wrap_confidence, &invalidate_wrapped, &phase_error, &max_range})
      if (parameter->given())
        throw ConfigError(parameter->parameter().name, "is for several modulation frequencies; the input has " +
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

  /// Quantile of chi-square with this many degrees of freedom: exceeded as rarely by good samples as this many standard
  /// deviations, on either side, by a normal number.
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
        .steepest = known ? 0.36F : never,  // 0.6 rad: half a turn corresponds to five standard deviations
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
                            ", so it must be given, e.g. max_range: 20 m");
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
