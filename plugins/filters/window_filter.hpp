// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Base class of the filters with weights exp(-d^2 / h^2) over a square window.
#pragma once

#include <tbb/concurrent_queue.h>
#include <tbb/parallel_for.h>
#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "plugins/filters/neighbourhood.hpp"
#include "plugins/filters/window_images.hpp"

namespace tofgraph {

/// Ports, parameters and the arithmetic per pixel. The result of pixel x is sum_y w(x, y) u(y) / sum_y w(x, y) over the
/// valid pixels y of its window, including x itself with weight 1.
///
/// sigma becomes the standard deviation of the mean for noise that is independent from pixel to pixel. The weights
/// depend on the noise, above all that of x itself, so it is larger than sqrt(sum w^2 sigma^2) / sum w. To first order,
/// for the weights exp(-d^2 / h^2) of single pixels, with W = sum w, V the weighted variance of the window's lengths
/// and a = 2 V / h^2:
///
///   sigma_x^2 (1 / W + a)^2 + (1 + 2 a^2) / (1 + a)^2 sum_{y != x} (w sigma_y / W)^2 - a^2 min(sigma_x^2, S),
///
/// S = sum (w sigma / W)^2. The last term is of second order. For weights of patches see spread_vector.hpp. By Monte
/// Carlo it agrees within 10 % with the spread on flat boards, on slopes of up to one sigma per pixel and where two
/// amplitudes meet, for h of 0.7 to 5 sigma; at edges it is at least 0.8 of the spread. The shift of the mean at a
/// slope or an edge (its bias) is not part of it. An unknown sigma (NaN at a valid pixel) makes those of its neighbours
/// unknown too.
struct WindowFilter : LengthFilter {
  Param<double> strength{this,
                         "strength",
                         {.unit = "m",
                          .default_value = "auto",
                          .max = 1e3,
                          .choices = "auto",
                          .text = "h, the difference at which a weight is 1/e, e.g. 20 mm; auto: sqrt(2) times the "
                                  "median of the frame's sigma, equation (7.9)",
                          .live = true}};
  Param<bool> sigma_adaptive{this,
                             "sigma_adaptive",
                             {.default_value = "false",
                              .text = "h of each pixel proportional to its sigma, equal to `strength` at the median "
                                      "sigma: the less light, the smoother",
                              .live = true}};
  Param<bool> fill{this,
                   "fill",
                   {.default_value = "false",
                    .text = "an invalid pixel takes the median of the filtered ones in its window, if at least half "
                            "of the window is valid, and is flagged as filled",
                    .live = true}};

  void parameters_changed() { check_strength(); }

 protected:
  static constexpr double min_strength = 1e-6;   // m
  static constexpr float min_sigma = 1.0F / 64;  // relative to the median, in sigma_adaptive

  /// @param name, side the parameter of the window's width and its value, px
  void prepare_window(Setup& setup, const std::string& name, std::int64_t side) {
    check_window(*setup.find(image.channel()), name, side);
    window_ = HalfWindow{side / 2};
    spatial_.assign(static_cast<std::size_t>(window_.count()), 0);
    check_strength();
    prepare_lengths(setup);
  }

  /// Sets the second factor of a weight, exp(-exponent(dy, dx)).
  template <class Exponent> void set_spatial(Exponent&& exponent) {
    for (std::ptrdiff_t dy = 0; dy <= window_.radius; ++dy) {
      for (std::ptrdiff_t dx = window_.first_column(dy); dx <= window_.radius; ++dx) {
        spatial_[static_cast<std::size_t>(window_.index(dy, dx))] =
            static_cast<float>(exponent(static_cast<double>(dy), static_cast<double>(dx)) * std::numbers::log2e);
      }
    }
  }

  /// Filters a frame. @param border columns and rows beyond the window that the weights access
  /// @param extend additional set-up of a filter: extend(WindowFrame&, h in m, median of sigma in m or 0)
  /// @param filter processes a tile: filter(const WindowFrame&, const Tile&)
  template <class Extend, class FilterTile>
  void filter(const Frame& frame, std::ptrdiff_t border, Extend&& extend, FilterTile&& filter) const {
    const Lengths in = begin(frame);
    if (!in.any) return;
    const Array<float>&lengths = in.image, &deviations = in.sigma;
    const Array<std::uint16_t>& bits = in.flags;
    std::unique_ptr<WindowFrame> f;
    if (!spare_.try_pop(f)) f = std::make_unique<WindowFrame>();
    const double middle = median_sigma(deviations);
    const double h = strength.keyword() == "auto" ? std::numbers::sqrt2 * middle : *strength;
    set_frame(*f, lengths, deviations, 3 * window_.radius + border, h, middle);
    extend(*f, h, middle);
    const std::vector<Tile> tiles = tiles_of(f->rows, f->columns, window_);
    tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) { filter(*f, tiles[i]); });
    spare_.push(std::move(f));
    if (*fill) fill_invalid(lengths, deviations, bits, static_cast<std::size_t>(window_.radius));
  }

  /// Copies value(pixel) into an image with a border.
  template <class Value>
  static void pad(const WindowFrame& f, PaddedImage& image, std::ptrdiff_t border, float outside, Value&& value) {
    image.reset(f.rows, f.columns, border, outside);
    std::size_t i = 0;
    for (std::ptrdiff_t r = 0; r < f.rows; ++r) {
      float* row = image.row(r);
      for (std::ptrdiff_t c = 0; c < f.columns; ++c) row[c] = value(i++);
    }
  }

  std::ptrdiff_t window_radius() const { return window_.radius; }
  bool uses_noise_ = false;  // the median of sigma is needed not only for h

 private:
  void check_strength() const {
    const bool automatic = strength.keyword() == "auto";
    if (!automatic && !(*strength >= min_strength))
      throw ConfigError("strength", "must be a length of at least 1 um, e.g. 20 mm");
    if (sigma.present()) return;
    const std::string hint =
        ": let the decoder know the noise (a camera profile with it, or its parameters read_noise "
        "and shot_noise), or put noise_model before it";
    if (automatic)
      throw ConfigError("strength", "auto needs the channel sigma, which is missing" + hint +
                                        ", or write a length, e.g. strength: 20 mm");
    if (*sigma_adaptive) throw ConfigError("sigma_adaptive", "needs the channel sigma, which is missing" + hint);
  }

  void set_frame(WindowFrame& f, const Array<float>& lengths, const Array<float>& deviations, std::ptrdiff_t border,
                 double h, double middle) const {
    const double unit = h * std::sqrt(std::numbers::ln2);
    f.rows = static_cast<std::ptrdiff_t>(lengths.rows());
    f.columns = static_cast<std::ptrdiff_t>(lengths.columns());
    f.window = window_;
    f.spatial = spatial_.data();
    f.unit = static_cast<float>(unit);
    f.lengths = lengths.data();
    f.sigma = deviations.data();
    f.adaptive = *sigma_adaptive;
    const auto scale = static_cast<float>(1 / unit), typical = static_cast<float>(middle);
    pad(f, f.scaled, border, WindowFrame::far_away,
        [&](std::size_t i) { return lengths[i] == lengths[i] ? lengths[i] * scale : WindowFrame::far_away; });
    if (deviations) {
      pad(f, f.variance, border, 0,
          [&](std::size_t i) { return lengths[i] == lengths[i] ? deviations[i] * deviations[i] : 0.0F; });
    }
    if (f.adaptive) {
      pad(f, f.softness, border, 1, [&](std::size_t i) {
        return typical / std::max(typical * min_sigma, deviations[i]);  // NaN: the minimum
      });
    }
  }

  /// Median of the frame's sigma if it is needed, m; else 0.
  double median_sigma(const Array<float>& deviations) const {
    if (strength.keyword() != "auto" && !*sigma_adaptive && !uses_noise_) return 0;
    std::vector<float> known;
    std::ranges::copy_if(deviations, std::back_inserter(known), [](float s) { return std::isfinite(s); });
    const double middle = known.empty() ? 0 : static_cast<double>(median_of(known));
    if (middle >= min_strength) return middle;
    throw std::runtime_error("the frame's sigma has no median above 1 um: write a length, e.g. strength: 20 mm");
  }

  HalfWindow window_{};
  std::vector<float> spatial_;
  mutable tbb::concurrent_queue<std::unique_ptr<WindowFrame>> spare_;  // reused from frame to frame
};

}  // namespace tofgraph
