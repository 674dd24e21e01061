// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/superpixels.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tofgraph::diagnosis {

namespace {

/// Names of FrameSums::Kind, in its order.
constexpr std::array<const char*, 4> kind_names = {"taps", "phases", "decoded", "distances"};

FrameSums::Kind kind_of(const std::string& name) {
  const auto found = std::ranges::find(kind_names, name);
  if (found == kind_names.end()) throw std::invalid_argument("the statistics are of an unknown kind: " + name);
  return static_cast<FrameSums::Kind>(found - kind_names.begin());
}

/// Signal of a pixel relative to the ideal camera's: ideally independent of the pixel's position.
struct Relative {
  double real, imaginary, intensity, null1, null2;
  static constexpr std::array<double Relative::*, 5> all();
};
constexpr std::array<double Relative::*, 5> Relative::all() {
  return {&Relative::real, &Relative::imaginary, &Relative::intensity, &Relative::null1, &Relative::null2};
}

/// True for pixels that are no outliers in any of the five numbers.
std::vector<bool> inliers(const std::vector<Relative>& pixels) {
  std::vector<bool> good(pixels.size(), true);
  std::vector<double> values(pixels.size());
  for (const auto member : Relative::all()) {
    for (std::size_t i = 0; i < pixels.size(); ++i) values[i] = pixels[i].*member;
    const double centre = physics::median(values);
    for (std::size_t i = 0; i < pixels.size(); ++i) values[i] = std::abs(pixels[i].*member - centre);
    const double limit = settings.pixel_outlier * physics::sd_of_deviations * physics::median(values);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (limit > 0 && std::abs(pixels[i].*member - centre) > limit) good[i] = false;
    }
  }
  return good;
}

}  // namespace

FrameSums::FrameSums(Kind kind, std::size_t width, std::size_t height, const Demodulation& demodulation)
    : kind_(kind),
      camera_(demodulation),
      demodulation_(kind == Kind::taps || kind == Kind::phases ? demodulation : four_steps()),
      width_(width),
      height_(height),
      exposures_(demodulation_.exposures()) {
  const std::size_t pixels = width * height;
  content_.kind = kind_names.at(static_cast<std::size_t>(kind));
  content_.limit = std::numeric_limits<double>::infinity();
  content_.sum.assign(pixels * exposures_, 0);
  content_.square.assign(pixels, 0);
  content_.intensity.assign(pixels, 0);
  content_.bad.assign(pixels, 0);
}

FrameSums::FrameSums(io::PixelSums content, std::size_t width, std::size_t height, const Demodulation& demodulation)
    : FrameSums(kind_of(content.kind), 0, 0, demodulation) {
  width_ = width;
  height_ = height;
  if (content.sum.size() != width * height * exposures_ || content.square.size() != width * height)
    throw std::invalid_argument("the statistics are of another number of pixels or exposures than the camera's");
  content_ = std::move(content);
}

void FrameSums::add(std::size_t i, std::span<const double> samples, double intensity) {
  for (std::size_t k = 0; k < exposures_; ++k) {
    content_.sum[i * exposures_ + k] += samples[k];
    content_.square[i] += samples[k] * samples[k];
  }
  content_.intensity[i] += intensity;
}

void FrameSums::add_taps(std::span<const std::uint16_t> taps, double full_well) {
  const std::size_t n = content_.square.size();
  content_.limit = full_well > 0 ? std::min(full_well, 65535.0) : 65535.0;
  // Image by image in parts that fit into the cache: the compiler vectorises the loops. All sums but that of the
  // intensity are integers, so their order does not matter.
  constexpr std::size_t part = 512;
  std::array<std::int32_t, part> sample, sum, most;
  std::array<double, part> square;
  for (std::size_t begin = 0; begin < n; begin += part) {
    const std::size_t count = std::min(part, n - begin);
    sum.fill(0);
    most.fill(0);
    square.fill(0);
    for (std::size_t k = 0; k < exposures_; ++k) {
      const std::uint16_t *const as = &taps[2 * k * n + begin], *const bs = as + n;
      for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t a = as[i], b = bs[i];
        sample[i] = a - b;
        sum[i] += a + b;
        most[i] = std::max(most[i], std::max(a, b));
        square[i] += static_cast<double>(sample[i]) * static_cast<double>(sample[i]);
      }
      for (std::size_t i = 0; i < count; ++i) content_.sum[(begin + i) * exposures_ + k] += sample[i];
    }
    for (std::size_t i = 0; i < count; ++i) {
      content_.square[begin + i] += square[i];
      content_.intensity[begin + i] += sum[i] / (2 * static_cast<double>(exposures_));
      if (most[i] >= content_.limit) content_.bad[begin + i] |= io::PixelSums::saturated;
    }
  }
  ++content_.frames;
}

void FrameSums::add_phases(std::span<const float> phases) {
  const std::size_t n = content_.square.size();
  constexpr std::size_t part = 512;  // as above
  std::array<std::int32_t, part> finite;
  for (std::size_t begin = 0; begin < n; begin += part) {
    const std::size_t count = std::min(part, n - begin);
    finite.fill(1);
    for (std::size_t k = 0; k < exposures_; ++k) {
      for (std::size_t i = 0; i < count; ++i)
        finite[i] &=
            static_cast<std::int32_t>(std::abs(phases[k * n + begin + i]) <= std::numeric_limits<float>::max());
    }
    std::int32_t all = 1;
    for (std::size_t i = 0; i < count; ++i) all &= finite[i];
    for (std::size_t i = 0; i < count && all == 0; ++i)
      if (finite[i] == 0) content_.bad[begin + i] |= io::PixelSums::no_number;
    for (std::size_t k = 0; k < exposures_; ++k) {
      const float* const samples = &phases[k * n + begin];
      double *const square = &content_.square[begin], *const sum = &content_.sum[begin * exposures_ + k];
      for (std::size_t i = 0; i < count; ++i) {
        if (all == 0 && finite[i] == 0) continue;
        const double sample = samples[i];
        square[i] += sample * sample;
        sum[i * exposures_] += sample;
      }
    }
  }
  ++content_.frames;
}

void FrameSums::add_decoded(std::span<const float> distances, std::span<const float> amplitudes,
                            double metres_per_radian) {
  for (std::size_t i = 0; i < content_.square.size(); ++i) {
    const double length = distances[i], strength = amplitudes.empty() ? 1 : amplitudes[i];
    if (std::isfinite(length + strength))
      add(i, physics::samples_of(std::polar(strength, length / metres_per_radian)), 0);
    else
      content_.bad[i] |= io::PixelSums::no_number;
  }
  ++content_.frames;
}

std::size_t FrameSums::saturated(const std::array<std::size_t, 4>& roi) const {
  std::size_t count = 0;
  for (std::size_t row = roi[2]; row <= roi[3]; ++row)
    for (std::size_t column = roi[0]; column <= roi[1]; ++column)
      count += (content_.bad[row * width_ + column] & io::PixelSums::saturated) != 0 ? 1U : 0U;
  return count;
}

Signal FrameSums::mean(std::size_t i) const {
  const auto frames = static_cast<double>(content_.frames);
  Signal signal = demodulation_.of_samples(sums(i), content_.intensity[i]);
  signal.phasor /= frames;
  if (is_decoded()) return {signal.phasor};  // its other values are rounding errors
  signal.intensity /= frames;
  signal.null1 /= frames;
  signal.null2 /= frames;
  return signal;
}

/// Reduction of one condition to superpixels.
class Reduction {
 public:
  Reduction(const FrameSums& sums, std::span<const Signal> ideal, const physics::TapNoise& noise, double scale,
            bool stands_in, const PixelPhases* own, PixelPhases* found)
      : sums_(sums),
        ideal_(ideal),
        noise_(noise),
        scale_(scale),
        frames_(static_cast<double>(sums.content_.frames)),
        stands_in_(stands_in),
        found_(found) {
    means_.reserve(ideal_.size());
    for (std::size_t i = 0; i < ideal_.size(); ++i) {
      Signal& signal = means_.emplace_back(sums_.mean(i));
      if (stands_in_) signal += ideal_[i];
      if (own != nullptr) signal.phasor = own->aligned(i, signal.phasor);
    }
  }

  void superpixel(const std::vector<std::size_t>& candidates, std::size_t s, std::size_t n, Observations& out,
                  ReductionCounts& counts) const {
    std::vector<std::size_t> pixels;
    std::vector<Relative> relative;
    for (const std::size_t i : candidates) {
      if (!sums_.is_usable(i) || !(std::abs(ideal_[i].phasor) > 0)) continue;
      pixels.push_back(i);
      relative.push_back(relative_to_ideal(i));
    }
    counts.pixels += candidates.size();
    if (pixels.size() < settings.min_pixels) return;
    const std::vector<bool> good = inliers(relative);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (good[i]) kept.push_back(pixels[i]);
    }
    counts.bad += pixels.size() - kept.size();
    // Near the full well noise decides which pixels are clipped, so the mean of the remaining ones is biased.
    if (std::ranges::any_of(kept, [this](std::size_t i) {
          return brightest(i) > settings.max_full_well_fraction * sums_.content_.limit;
        }))
      return;
    if (kept.size() < settings.min_pixels) return;
    const std::complex<double> ratio = summarise(kept, s, n, out);
    const bool knows_light = sums_.kind_ != FrameSums::Kind::distances;
    if (knows_light && sums_.content_.frames > 1 && noise_.known() && !stands_in_ &&
        std::isfinite(out.variance[distance * n + s])) {
      double expected = 0;
      for (const std::size_t i : kept) expected += profile_variance(i) / static_cast<double>(kept.size());
      counts.noise += sample_variance(kept) / expected * static_cast<double>(kept.size());
      counts.compared += kept.size();
    }
    if (found_ == nullptr || std::isinf(out.variance[distance * n + s])) return;
    const double variance = of_component(kept).across;
    for (const std::size_t i : pixels) found_->add(i, mean(i).phasor, ratio * ideal_[i].phasor, variance);
  }

 private:
  const Signal& mean(std::size_t i) const { return means_[i]; }

  /// Mean of the brightest tap, counts.
  double brightest(std::size_t i) const {
    double most = 0;
    for (const double c : sums_.sums(i)) most = std::max(most, std::abs(c));
    return (sums_.content_.intensity[i] + most / 2) / frames_;
  }

  Relative relative_to_ideal(std::size_t i) const {
    const Signal& m = mean(i);
    const std::complex<double> q = m.phasor / ideal_[i].phasor;
    const double a = std::abs(ideal_[i].phasor);
    return {q.real(), q.imag(), m.intensity / ideal_[i].intensity, m.null1 / a, m.null2 / a};
  }

  /// Variance of one sample c_k in counts^2 (dimensionless for distances alone, whose amplitude is 1): measured between
  /// frames, or for a single frame the profile's, scaled to the scatter between neighbouring pixels.
  double sample_variance(const std::vector<std::size_t>& pixels) const {
    double sum = 0;
    if (sums_.content_.frames < 2) {
      for (const std::size_t i : pixels) sum += profile_variance(i);
      return sum / static_cast<double>(pixels.size()) * scatter_ratio(pixels);
    }
    for (const std::size_t i : pixels) {
      double squares = sums_.content_.square[i];
      for (const double c : sums_.sums(i)) squares -= c * c / frames_;
      sum += squares / (static_cast<double>(sums_.exposures_) * (frames_ - 1));
    }
    return sum / static_cast<double>(pixels.size());
  }

  /// Variance of neighbouring pixels in a row across the phasor, over that of the profile's noise, which may differ
  /// from the camera's. 1 if there are too few pairs.
  double scatter_ratio(const std::vector<std::size_t>& pixels) const {
    std::complex<double> product, sum;
    double square = 0;
    for (const std::size_t i : pixels) {
      const std::complex<double> seen = mean(i).phasor;
      product += seen * std::conj(ideal_[i].phasor);
      square += std::norm(ideal_[i].phasor);
      sum += seen;
    }
    const std::complex<double> ratio = product / square;
    const double share = sums_.is_decoded() ? 1 : sums_.demodulation_.variance(sum).across;
    const auto across = [&](std::size_t i) { return (mean(i).phasor / (ratio * ideal_[i].phasor)).imag(); };
    const auto expected = [&](std::size_t i) {
      return share * profile_variance(i) / std::norm(ratio * ideal_[i].phasor);
    };
    double squares = 0, variances = 0;
    std::size_t pairs = 0;
    for (std::size_t k = 0; k + 1 < pixels.size(); ++k) {
      if (pixels[k + 1] != pixels[k] + 1) continue;
      squares += std::pow(across(pixels[k + 1]) - across(pixels[k]), 2);
      variances += expected(pixels[k]) + expected(pixels[k + 1]);
      ++pairs;
    }
    return pairs < settings.min_neighbours || !(variances > 0) ? 1 : squares / variances;
  }

  double profile_variance(std::size_t i) const {
    const double ideal = std::abs(ideal_[i].phasor);
    const double gain = std::abs(sums_.mean(i).phasor) / ideal;
    switch (sums_.kind_) {
      case FrameSums::Kind::taps:
        return noise_.sample_variance(sums_.content_.intensity[i] / frames_);
      case FrameSums::Kind::phases:
        return noise_.sample_variance(ideal_[i].intensity * gain);
      case FrameSums::Kind::decoded:
        return noise_.sample_variance(ideal_[i].intensity * gain) * of_components(i);
      case FrameSums::Kind::distances:
        break;
    }
    return noise_.sample_variance(ideal_[i].intensity) * of_components(i) / (ideal * ideal);
  }
  /// Mean variance of a decoded phasor's two components, for samples of variance 1.
  double of_components(std::size_t i) const {
    const auto [along, across] = sums_.camera_.variance(sums_.mean(i).phasor);
    return (along + across) / 2;
  }

  /// Variances of the components of a pixel's mean phasor; for decoded frames both are the variance of a sample.
  Demodulation::Variance of_component(const std::vector<std::size_t>& pixels) const {
    const double variance = std::max(sample_variance(pixels), settings.min_sample_variance) / frames_;
    if (sums_.is_decoded()) return {variance, variance};
    std::complex<double> sum;
    for (const std::size_t i : pixels) sum += mean(i).phasor;
    const auto [along, across] = sums_.demodulation_.variance(sum);
    return {along * variance, across * variance};
  }

  /// @returns ratio of the measured to the ideal phasor
  std::complex<double> summarise(const std::vector<std::size_t>& pixels, std::size_t s, std::size_t n,
                                 Observations& out) const {
    std::complex<double> product;
    double square = 0, light = 0, ideal_light = 0, null1_sum = 0, null2_sum = 0, amplitudes = 0;
    for (const std::size_t i : pixels) {
      const Signal& m = mean(i);
      const std::complex<double> base = ideal_[i].phasor;
      product += m.phasor * std::conj(base);
      square += std::norm(base);
      amplitudes += std::abs(base);
      light += m.intensity;
      ideal_light += ideal_[i].intensity;
      null1_sum += m.null1;
      null2_sum += m.null2;
    }
    const std::complex<double> ratio = product / square;
    const double gain = std::abs(ratio), variance = std::max(sample_variance(pixels), settings.min_sample_variance);
    const double count = static_cast<double>(pixels.size()) * frames_;
    const auto [along, across] = of_component(pixels);
    const double relative = 1 / (square * gain * gain);  // ratio's variance per component over a pixel's
    if (!(std::max(along, across) * relative * settings.min_amplitude * settings.min_amplitude < 1)) return ratio;
    const double number = static_cast<double>(pixels.size());
    // A tap cannot be negative, so if noise reaches zero the mean of the samples is biased. A board that dark is
    // excluded. A capped lens is kept, because a signal near zero is informative: its bias is below the noise of one
    // tap and equal in all superpixels, so a single superpixel represents all. Other kinds of frames are computed from
    // taps and may have been clipped, too.
    const double own_light = stands_in_ ? light - ideal_light : light;
    const double own_amplitudes = stands_in_ ? std::abs(ratio - 1.0) * amplitudes : gain * amplitudes;
    const bool is_taps = sums_.kind_ == FrameSums::Kind::taps;
    const bool dark = own_light - own_amplitudes / 2 < settings.min_tap_mean * std::sqrt(variance / 2) * number;
    const bool clipped = is_taps ? dark : stands_in_;
    const auto known = [](double v) { return std::isfinite(v); };
    if (clipped && (!stands_in_ || std::ranges::any_of(out.variance, known))) return ratio;
    // counts^2, of a mean of pixels: lower limit of the noise, for taps that are all zero
    constexpr double rounding = 1.0 / 12;
    const double read = noise_.known() ? noise_.read_noise * noise_.read_noise : 0;
    const double wrong = clipped ? std::max({variance / 2, read, rounding}) : 0;
    const double turned = wrong * number / square;
    const auto set = [&](std::size_t observable, double value, double its_variance) {
      out.value[observable * n + s] = value;
      out.variance[observable * n + s] = its_variance;
    };
    set(distance, scale_ * std::arg(ratio), scale_ * scale_ * (across * relative + turned));
    if (sums_.kind_ != FrameSums::Kind::distances) set(amplitude, std::log(gain), along * relative + turned);
    if (sums_.is_decoded()) return ratio;
    const Demodulation& fit = sums_.demodulation_;
    const double per_sample = variance / count;  // variance of the mean of a sample
    const double level = 2 * ideal_light * gain / number;
    const double mean_amplitude = gain * amplitudes / number;
    set(null1, null1_sum / number / level, (per_sample * fit.null1_variance() + wrong) / (level * level));
    if (fit.has_null2())
      set(null2, null2_sum / number / mean_amplitude,
          (per_sample * fit.null2_variance() + wrong) / (mean_amplitude * mean_amplitude));
    if (sums_.kind_ == FrameSums::Kind::taps)
      set(intensity, std::log(light / ideal_light),
          (per_sample / (4 * static_cast<double>(fit.exposures())) + wrong) / std::pow(light / number, 2));
    return ratio;
  }

  const FrameSums& sums_;
  std::span<const Signal> ideal_;
  const physics::TapNoise& noise_;
  double scale_, frames_;
  bool stands_in_;
  PixelPhases* found_;
  std::vector<Signal> means_;  ///< one per pixel, without its own phase offset
};

Observations reduce(const FrameSums& sums, std::span<const Signal> ideal, std::size_t grid,
                    const physics::TapNoise& noise, double metres_per_radian, const std::array<std::size_t, 4>& roi,
                    ReductionCounts& counts, const PixelPhases* own, PixelPhases* found, bool stands_in) {
  if (sums.frames() < 2 && !noise.known())
    throw std::invalid_argument(
        "there is one frame only and the camera's profile has no read_noise and shot_noise: record some frames of "
        "each condition, or write its read_noise and shot_noise, in counts, into the profile");
  const std::size_t n = grid * grid;
  Observations out{std::vector<double>(observables * n, 0),
                   std::vector<double>(observables * n, std::numeric_limits<double>::infinity())};
  const Reduction reduction(sums, ideal, noise, metres_per_radian, stands_in, own, found);
  for (std::size_t s = 0; s < n; ++s) {
    std::vector<std::size_t> pixels;
    const std::size_t row = s / grid, column = s % grid;
    for (std::size_t v = first_of(row, sums.height(), grid); v < first_of(row + 1, sums.height(), grid); ++v) {
      for (std::size_t u = first_of(column, sums.width(), grid); u < first_of(column + 1, sums.width(), grid); ++u) {
        if (u >= roi[0] && u <= roi[1] && v >= roi[2] && v <= roi[3]) pixels.push_back(v * sums.width() + u);
      }
    }
    reduction.superpixel(pixels, s, n, out, counts);
  }
  return out;
}

void PixelPhases::add(std::size_t pixel, std::complex<double> seen, std::complex<double> expected, double variance) {
  sum_[pixel] += seen * std::conj(expected) / variance;
  information_[pixel] += std::norm(expected) / variance;
  ++seen_[pixel];
}

PixelPhases& PixelPhases::operator+=(const PixelPhases& other) {
  for (std::size_t p = 0; p < other.sum_.size(); ++p) {
    sum_[p] += other.sum_[p];
    information_[p] += other.information_[p];
    seen_[p] += other.seen_[p];
  }
  return *this;
}

bool PixelPhases::stand_out() const {
  double beyond = 0, conditions = 0;
  for (std::size_t p = 0; p < sum_.size(); ++p) {
    if (seen_[p] < 2) continue;
    beyond += sum_[p].imag() * sum_[p].imag() / information_[p] - 1;
    conditions += seen_[p];
  }
  return beyond > settings.pixel_phase_excess * conditions;
}

std::complex<double> PixelPhases::aligned(std::size_t pixel, std::complex<double> phasor) const {
  const double length = std::abs(sum_[pixel]);
  return length > 0 ? phasor * std::conj(sum_[pixel]) / length : phasor;
}

}  // namespace tofgraph::diagnosis
