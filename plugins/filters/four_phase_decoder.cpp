// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Four-phase decoding: distance, amplitude, intensity, sigma and flags from the samples of one modulation period.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/four_phase_decoder.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/vector_phase.hpp>

#ifndef TOFGRAPH_FOUR_PHASE_DECODER_ONCE
#define TOFGRAPH_FOUR_PHASE_DECODER_ONCE
namespace tofgraph {

/// What is the same for all pixels of a frame.
struct DecoderSettings {
  float metres_per_radian, range;          // m/rad, m
  float full_well;                         // counts; infinity: not known
  float min_amplitude;                     // counts
  float read_variance, shot_noise;         // of a tap: variance = read_variance + shot_noise intensity
  float intensity_per_amplitude;           // for phases, which do not show the light: 1 / (2 contrast)
  float null2_square, null2_per_variance;  // inconsistent: N2^2 > null2_square + null2_per_variance variance
  std::int32_t invalid_flags;              // bits that make a pixel invalid
};

/// Where a frame's channels are; null: not wanted.
struct DecoderImages {
  const void* samples;  // 4 phases, or 4 x 2 taps
  std::uint32_t type;   // of the samples
  std::size_t pixels;
  float* distance;
  float* amplitude;
  float* intensity;  // with taps only
  float* sigma;
  std::uint16_t* flags;  // read and combined
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A vector of samples as float.
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const float* from) { return hn::LoadU(d, from); }
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const std::int32_t* from) {
  return hn::ConvertTo(d, hn::LoadU(hn::RebindToSigned<D>(), from));
}
template <class D, class T>  // 16 bits
HWY_INLINE hn::Vec<D> LoadFloat(D d, const T* from) {
  return hn::ConvertTo(d, hn::PromoteTo(hn::RebindToSigned<D>(), hn::LoadU(hn::Rebind<T, D>(), from)));
}

/// The four samples of a vector of pixels, with the sum and the greatest of the taps where there are taps.
template <class D> struct Samples { hn::Vec<D> c[4], sum, greatest; };

template <class D, class T> HWY_INLINE Samples<D> LoadPhases(D d, const T* from, std::size_t pixels) {
  const auto c = [&](std::size_t k) { return LoadFloat(d, from + k * pixels); };
  return {{c(0), c(1), c(2), c(3)}, hn::Zero(d), hn::Zero(d)};
}

/// Integers as long as they can be: exact, and half as many conversions.
template <class D> HWY_INLINE Samples<D> LoadTaps(D d, const std::uint16_t* from, std::size_t pixels) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  Samples<D> samples;
  auto sum = hn::Zero(di);
  auto greatest = hn::Zero(du16);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto a = hn::LoadU(du16, from + (2 * k) * pixels), b = hn::LoadU(du16, from + (2 * k + 1) * pixels);
    greatest = hn::Max(greatest, hn::Max(a, b));
    const auto wide_a = hn::PromoteTo(di, a), wide_b = hn::PromoteTo(di, b);
    samples.c[k] = hn::ConvertTo(d, hn::Sub(wide_a, wide_b));
    sum = hn::Add(sum, hn::Add(wide_a, wide_b));
  }
  samples.sum = hn::ConvertTo(d, sum);
  samples.greatest = hn::ConvertTo(d, hn::PromoteTo(di, greatest));
  return samples;
}

/// One vector of pixels, beginning at pixel i. `Taps`: T is the type of the taps, else of the phases.
template <bool Taps, class T, class D>
HWY_INLINE void DecodeAt(D d, const DecoderSettings& s, const DecoderImages& images, std::size_t i) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const T* from = static_cast<const T*>(images.samples) + i;
  Samples<D> samples;
  if constexpr (Taps)
    samples = LoadTaps(d, from, images.pixels);
  else
    samples = LoadPhases(d, from, images.pixels);
  const auto& [c, sum, greatest] = samples;
  const V sine = hn::Sub(c[3], c[1]), cosine = hn::Sub(c[0], c[2]);
  const V amplitude = hn::Mul(hn::Set(d, 0.5F), hn::Sqrt(hn::MulAdd(sine, sine, hn::Mul(cosine, cosine))));
  const V intensity =
      Taps ? hn::Mul(sum, hn::Set(d, 0.125F)) : hn::Mul(amplitude, hn::Set(d, s.intensity_per_amplitude));
  const V tap_variance = hn::MulAdd(hn::Set(d, s.shot_noise), intensity, hn::Set(d, s.read_variance));
  const V null2 = hn::Mul(hn::Set(d, 0.25F), hn::Sub(hn::Add(c[0], c[2]), hn::Add(c[1], c[3])));
  const V limit = hn::MulAdd(hn::Set(d, s.null2_per_variance), tap_variance, hn::Set(d, s.null2_square));

  auto flags = hn::PromoteTo(di, hn::LoadU(du16, images.flags + i));
  const auto raise = [&](hn::Mask<D> where, std::uint16_t flag) {
    flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, where), hn::Set(di, flag)));
  };
  if constexpr (Taps) raise(hn::Ge(greatest, hn::Set(d, s.full_well)), flag::saturated);
  raise(hn::Lt(amplitude, hn::Set(d, s.min_amplitude)), flag::low_signal);
  raise(hn::Gt(hn::Mul(null2, null2), limit), flag::inconsistent);
  const auto bad = hn::And(flags, hn::Set(di, s.invalid_flags));
  // Without light, or with samples that are no numbers, there is no phase.
  const auto measured =
      hn::And(hn::Gt(amplitude, hn::Zero(d)), hn::Lt(amplitude, hn::Set(d, hwy::HighestValue<float>())));
  const auto valid = hn::And(measured, hn::RebindMask(d, hn::Eq(bad, hn::Zero(di))));
  raise(hn::Not(valid), flag::invalid);
  hn::StoreU(hn::DemoteTo(du16, flags), du16, images.flags + i);

  const V nan = hn::NaN(d);
  const V distance =
      physics::HWY_NAMESPACE::WrappedDistance(d, sine, cosine, hn::Set(d, s.metres_per_radian), hn::Set(d, s.range));
  hn::StoreU(hn::IfThenElse(valid, distance, nan), d, images.distance + i);
  hn::StoreU(amplitude, d, images.amplitude + i);
  if (Taps) hn::StoreU(intensity, d, images.intensity + i);
  if (images.sigma != nullptr) {
    const V phase_sigma = hn::Div(hn::Sqrt(tap_variance), amplitude);
    hn::StoreU(hn::IfThenElse(valid, hn::Mul(hn::Set(d, s.metres_per_radian), phase_sigma), nan), d, images.sigma + i);
  }
}

template <bool Taps, class T>
void DecodeAll(const DecoderSettings settings, const DecoderImages images) {  // copies: no store can change them
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

/// Noise model: the variance of a tap is read_noise^2 + shot_noise * counts, a sample c_k is the difference of two
/// taps. Taps show their counts; phases do not, there the light is amplitude / (2 contrast) a tap, which misses ambient
/// light. sigma_D = c / (4 pi f_mod) * sqrt(variance of c_k / 2) / amplitude.
struct FourPhaseDecoder final : Filter {
  In<std::uint16_t> taps{
      this, "taps", {.shape = "4 2 H W", .optional = true, .text = "read first: they show saturation and light"}};
  In<void> phases{
      this,
      "phases",
      {.shape = "4 H W", .optional = true, .text = "read where there are no taps; float32, int16 or int32"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "made, or combined with those that arrive"}};
  Out<float> distance{this, "distance", {.from = "taps phases"}};
  Out<float> amplitude{this, "amplitude", {.from = "taps phases"}};
  Out<float> intensity{
      this, "intensity", {.optional = true, .text = "mean of the eight tap samples; not from phases", .from = "taps"}};
  Out<float> sigma{
      this, "sigma", {.optional = true, .text = "where the noise is known", .from = "taps phases", .of = "distance"}};

  Param<double> modulation_frequency{
      this,
      "modulation_frequency",
      {.unit = "Hz", .min = 1e3, .max = 1e10, .text = "instead of the frames' own, e.g. 20 MHz"}};
  Param<double> min_amplitude{
      this,
      "min_amplitude",
      {.unit = "counts", .fallback = "0 counts", .min = 0, .text = "less is flagged as low signal"}};
  Param<bool> invalidate_low_signal{
      this, "invalidate_low_signal", {.fallback = "false", .text = "pixels of low signal become invalid"}};
  Param<bool> invalidate_saturated{
      this, "invalidate_saturated", {.fallback = "true", .text = "saturated pixels become invalid"}};
  Param<double> inconsistent_above{
      this,
      "inconsistent_above",
      {.unit = "counts",
       .fallback = "auto",
       .min = 0,
       .choices = "auto off",
       .text = "flags |N2| = |c0 - c1 + c2 - c3| / 4 above this as inconsistent, which invalidates nothing; "
               "auto: five standard deviations where the noise is known, else off"}};
  Param<double> read_noise{this, "read_noise", {.unit = "counts", .min = 0, .text = "of a tap; default: the camera's"}};
  Param<double> shot_noise{
      this, "shot_noise", {.unit = "counts", .min = 0, .text = "variance of a tap per count; default: the camera's"}};
  Param<double> full_well{
      this,
      "full_well",
      {.unit = "counts", .min = 0, .text = "a tap that reaches it is saturated; default: the camera's"}};

  void prepare(Setup& setup) {
    if (!taps.present() && !phases.present())
      throw std::runtime_error("needs taps or phases, e.g. of a recording with raw samples");
    check_exposures(setup);
    if (!modulation_frequency.given() && !setup.knows(TOFGRAPH_KNOWS_MODULATION_FREQUENCY)) {
      throw ConfigError("modulation_frequency",
                        "the frames do not know it, so it has to be given, e.g. modulation_frequency: 20 MHz");
    }
    if (!taps.present() && setup.find("phases")->type != TOFGRAPH_TYPE_F32 &&
        setup.find("phases")->type != TOFGRAPH_TYPE_I16 && setup.find("phases")->type != TOFGRAPH_TYPE_I32) {
      throw std::runtime_error(std::string("phases are ") + element_name(setup.find("phases")->type) +
                               ", expected float32, int16 or int32");
    }
    flags.provide(setup);
    lengths_.prepare(setup, {});
    if (taps.present()) intensity.provide(setup);
    set_constants(setup.stream().camera);
    if (settings_.read_variance > 0 || settings_.shot_noise > 0) sigma.provide(setup);
  }

  void process(Frame& frame) const {
    const tofgraph_view samples = taps.present() ? frame.find("taps") : phases(frame);
    const std::size_t rows = samples.extent[samples.rank - 2], columns = samples.extent[samples.rank - 1];
    const double frequency =
        modulation_frequency.given() ? *modulation_frequency : frame.metadata().modulation_frequency;
    if (!(frequency > 0)) throw std::runtime_error("the frame does not know its modulation frequency");
    DecoderSettings settings = settings_;
    settings.metres_per_radian = static_cast<float>(physics::metres_per_radian(frequency));
    settings.range = static_cast<float>(physics::unambiguous_range(frequency));
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    HWY_DYNAMIC_DISPATCH(Decode)
    (settings, {.samples = samples.data,
                .type = samples.type,
                .pixels = rows * columns,
                .distance = distance(frame, rows, columns).data(),
                .amplitude = amplitude(frame, rows, columns).data(),
                .intensity = intensity.present() ? intensity(frame, rows, columns).data() : nullptr,
                .sigma = sigma.present() ? sigma(frame, rows, columns).data() : nullptr,
                .flags = bits.data()});
    lengths_.invalidate(frame, bits);
  }

 private:
  /// Four steps of 90 degrees, at one frequency.
  static void check_exposures(const Setup& setup) {
    const tofgraph_stream& stream = setup.stream();
    const Strided<const tofgraph_exposure> exposures{stream.exposures, stream.exposure_size, stream.exposure_count};
    for (std::size_t k = 0; k < exposures.size; ++k) {
      const double step = static_cast<double>(k) * M_PI / 2;
      if (exposures.size == 4 && std::abs(std::remainder(exposures[k].phase - step, 2 * M_PI)) < 1e-9 &&
          exposures[k].frequency == exposures[0].frequency)
        continue;
      throw std::runtime_error("decodes four exposures at 0, 90, 180 and 270 deg of one frequency, what arrives has " +
                               std::to_string(exposures.size) + ", and exposure " + std::to_string(k) + " is at " +
                               std::to_string(exposures[k].phase * 180 / M_PI) + " deg");
    }
  }

  /// All that does not depend on the frame.
  void set_constants(const tofgraph_camera* camera) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN(), never = std::numeric_limits<float>::infinity();
    const auto either = [](const Param<double>& given, double otherwise) { return given.given() ? *given : otherwise; };
    const physics::TapNoise noise{.read_noise = either(read_noise, camera != nullptr ? camera->read_noise : unknown),
                                  .shot_noise = either(shot_noise, camera != nullptr ? camera->shot_noise : unknown)};
    const double contrast = camera != nullptr ? camera->contrast : unknown;
    const bool known = noise.known() && (taps.present() || contrast > 0 || noise.shot_noise == 0);
    const double well = either(full_well, camera != nullptr ? camera->full_well : unknown);
    const bool automatic = inconsistent_above.word() == "auto" && known;
    settings_ = {
        .full_well = static_cast<float>(well > 0 ? well : never),
        .min_amplitude = static_cast<float>(*min_amplitude),
        .read_variance = static_cast<float>(known ? noise.read_noise * noise.read_noise : 0),
        .shot_noise = static_cast<float>(known ? noise.shot_noise : 0),
        .intensity_per_amplitude = static_cast<float>(contrast > 0 ? 1 / (2 * contrast) : 0),
        .null2_square = static_cast<float>(inconsistent_above.word().empty() ? *inconsistent_above * *inconsistent_above
                                           : automatic                       ? 0
                                                                             : never),
        // N2 is a quarter of four samples, of two taps each: its variance is half that of a tap
        .null2_per_variance = automatic ? 25.0F / 2 : 0.0F,
        .invalid_flags = flag::invalid | (*invalidate_saturated ? flag::saturated : 0) |
                         (*invalidate_low_signal ? flag::low_signal : 0)};
  }

  DecoderSettings settings_{};
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::FourPhaseDecoder, "Distance, amplitude, intensity, sigma and flags from four-phase samples")
#endif
