// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/inspection.hpp"

#include "config/log.hpp"
#include "config/quantity.hpp"
#include "io/codes.hpp"
#include "io/unknown.hpp"

#include <tofgraph/physics/amplitude_walk.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::inspection {
namespace {

constexpr std::size_t min_frames_of_still = 8;
constexpr double max_still = 0.002;     ///< share of constant pixels; beyond it, they are attributed to rounding
constexpr std::size_t min_bad = 3;      ///< pixels
constexpr double min_significance = 6;  ///< standard errors
constexpr double min_walk = 0.001;      ///< m per factor 2 of the amplitude
constexpr double min_contrast = 0.03;   ///< standard deviation of log(amplitude) within blocks
constexpr double notable_share = 0.01;  ///< share of the pixels

Finding finding(std::string kind, std::string text, std::string evidence, std::string mend, double size) {
  return {std::move(kind), std::move(text), std::move(evidence), std::move(mend), size, io::unknown};
}

/// Returns true if all eight neighbours differ by `limit` or more. Edge pixels have neighbours on their own side.
bool differs_from_all(const Observation& o, std::size_t i, double limit) {
  for (const std::size_t row : {i - o.width, i, i + o.width}) {
    for (const std::size_t at : {row - 1, row, row + 1})
      if (at != i && std::abs(o.length[at] - o.length[i]) < limit) return false;
  }
  return true;
}

/// Returns true if the lengths on both sides of a pixel belong to one surface; a dead row or column is then bad, too.
bool joins(double before, double after) { return std::abs(before - after) < 0.05 * before; }

/// Adds pixels that differ from their surface, never change, or have no value although their neighbours do.
void add_bad_pixels(Inspection& result) {
  const Observation& o = result.observation;
  const Surfaces& s = result.surfaces;
  std::size_t wild = 0, still = 0, dead = 0, all_still = 0;
  std::string first_dead;
  double size = 0;
  for (std::size_t row = 1; row + 1 < o.height; ++row) {
    for (std::size_t column = 1; column + 1 < o.width; ++column) {
      const std::size_t i = row * o.width + column;
      const bool alone = std::isfinite(o.length[i - 1]) && std::isfinite(o.length[i + 1]) &&
                         std::isfinite(o.length[i - o.width]) && std::isfinite(o.length[i + o.width]);
      if (std::isnan(o.length[i])) {
        if (!joins(o.length[i - 1], o.length[i + 1]) && !joins(o.length[i - o.width], o.length[i + o.width])) continue;
        if (dead == 0) first_dead = fmt::format(" (the first at column {}, row {})", column, row);
        ++dead;
        continue;
      }
      const double rest = s.rest.empty() ? io::unknown : std::abs(s.rest[i]);
      if (rest > 8 * s.pixel_noise + 0.01 * o.length[i] && differs_from_all(o, i, rest / 2)) {
        ++wild;
        size = std::max(size, rest);
      }
      all_still += o.deviation[i] == 0 ? 1 : 0;
      still += alone && o.deviation[i] == 0 && o.deviation[i - 1] > 0 && o.deviation[i + 1] > 0 ? 1 : 0;
    }
  }
  // Rounded values may be constant by chance.
  if (o.frames < min_frames_of_still || static_cast<double>(all_still) > max_still * static_cast<double>(o.pixels()))
    still = 0;
  if (wild + still + dead < min_bad) return;
  result.findings.push_back(finding(
      "bad_pixels", fmt::format("{} are bad", config::counted(wild + still + dead, "pixel")),
      fmt::format(
          "{} differ from the surface around them, {} never change, {} have no value although their neighbours do{}",
          wild, still, dead, first_dead),
      "bad_pixels: MAP, made by tofgraph calibrate noise", size));
}

/// Adds lengths that many pixels have exactly, far above the others, e.g. an overflow that was taken for a length.
void add_codes(Inspection& result) {
  const Observation& o = result.observation;
  std::vector<io::CountedValue> lengths;
  for (const double length : o.length) lengths.push_back({length});
  for (const auto& [value, count] : io::suspected_codes(std::move(lengths), std::numeric_limits<double>::infinity()))
    result.findings.push_back(finding(
        "codes",
        fmt::format("{} have a length that is probably a code and no measurement", config::counted(count, "pixel")),
        fmt::format("all of them {}, far above the other lengths", config::format_quantity(value, "m")),
        "--invalid CODE, the stored value, when the file is converted", io::unknown));
}

/// Adds rows or columns whose means scatter about the surface by more than the noise.
void add_stripes(Inspection& result) {
  const Observation& o = result.observation;
  const Surfaces& s = result.surfaces;
  if (s.rest.empty()) return;
  for (const bool rows : {true, false}) {
    const std::size_t lines = rows ? o.height : o.width, across = rows ? o.width : o.height;
    double excess = 0, judged = 0;
    for (std::size_t line = 0; line < lines; ++line) {
      double sum = 0, count = 0;
      for (std::size_t k = 0; k < across; ++k) {
        const std::size_t i = rows ? line * o.width + k : k * o.width + line;
        if (!std::isfinite(s.rest[i]) || std::abs(s.rest[i]) > 5 * s.pixel_noise) continue;
        sum += s.rest[i];
        ++count;
      }
      if (count < 20) continue;
      ++judged;
      excess += sum / count * (sum / count) - s.pixel_noise * s.pixel_noise / count;
    }
    const double size = judged > 0 ? std::sqrt(std::max(excess / judged, 0.0)) : 0;
    // If the noise is unknown (NaN), no finding is possible.
    if (judged < 20 || !(size >= 0.3 * s.pixel_noise && size >= 0.0005)) continue;
    result.findings.push_back(finding(
        "stripes", fmt::format("{} differ from each other", rows ? "rows" : "columns"),
        fmt::format(
            "their means scatter by {:.2g} mm about the surface, more than by noise: interference, or a readout "
            "that differs from line to line",
            1e3 * size),
        "tofgraph calibrate fixed-pattern if they do not move", size));
  }
}

void add_block(const Observation& o, const Surfaces& s, const Block& block, physics::WalkSums& sums) {
  const auto half = static_cast<std::ptrdiff_t>(s.side / 2);
  std::vector<physics::WalkPixel> pixels;
  for (std::ptrdiff_t v = -half; v <= half; ++v) {
    for (std::ptrdiff_t u = -half; u <= half; ++u) {
      const auto i =
          static_cast<std::size_t>((static_cast<std::ptrdiff_t>(block.row) + v) * static_cast<std::ptrdiff_t>(o.width) +
                                   static_cast<std::ptrdiff_t>(block.column) + u);
      if (!(o.amplitude[i] > 0) || !(std::abs(s.rest[i]) < 20 * s.pixel_noise)) continue;
      pixels.push_back({static_cast<double>(u), static_cast<double>(v), std::log(o.amplitude[i]), s.rest[i]});
    }
  }
  if (pixels.size() >= s.side * s.side - 3) sums.add(physics::walk_in_block(pixels));
}

/// Adds distance that depends on the amplitude within blocks of surfaces.
void add_walk(Inspection& result) {
  const Observation& o = result.observation;
  const Surfaces& s = result.surfaces;
  if (o.amplitude.empty() || s.rest.empty()) return;
  physics::WalkSums sums;
  for (const Block& block : s.blocks) add_block(o, s, block, sums);
  if (sums.n < 500 || sums.contrast() < min_contrast) return;
  const double slope = sums.slope() * std::log(2.0);
  const double error = s.pixel_noise / std::sqrt(sums.xx) * std::log(2.0);
  if (std::abs(slope) < min_walk || std::abs(slope) < min_significance * error) return;
  result.findings.push_back(finding(
      "amplitude", fmt::format("the {} {} with the amplitude", o.channel, slope > 0 ? "rises" : "falls"),
      fmt::format("by {:.2g} mm +- {:.1g} mm per factor 2 of the amplitude, within surfaces", 1e3 * slope, 1e3 * error),
      "tofgraph calibrate offset with targets of several reflectivities, or the effect amplitude_walk", slope));
}

void add_shares(Inspection& result) {
  const Shares& shares = result.observation.shares;
  const auto percent = [](double share) { return fmt::format("{:.2g} %", 100 * share); };
  if (shares.saturated > notable_share)
    result.findings.push_back(finding("saturated", percent(shares.saturated) + " of the pixels are saturated",
                                      "flag saturated", "a shorter integration time, or the stage hdr_fusion",
                                      io::unknown));
  if (shares.no_ray > 0)
    result.findings.push_back(finding("outside_lens", percent(shares.no_ray) + " of the pixels have no ray",
                                      "the lens model of the profile cannot be inverted there", "check `distortion`",
                                      io::unknown));
  result.facts.push_back(
      fmt::format("without a valid length {}, saturated {}, wrapped {}, low signal {}, outside the "
                  "lens model {} of the pixels",
                  percent(shares.missing), percent(shares.saturated), percent(shares.wrapped),
                  percent(shares.low_signal), percent(shares.no_ray)));
}

/// Adds the noise and its exponent of the amplitude: -0.5 for shot noise, -1 for read noise.
void add_noise(Inspection& result) {
  const Observation& o = result.observation;
  double n = 0, x1 = 0, y1 = 0, xx = 0, xy = 0;
  std::vector<double> deviations;
  for (std::size_t i = 0; i < o.pixels(); ++i) {
    if (!(o.deviation[i] > 0)) continue;
    deviations.push_back(o.deviation[i]);
    if (o.amplitude.empty() || !(o.amplitude[i] > 0)) continue;
    const double x = std::log(o.amplitude[i]), y = std::log(o.deviation[i]);
    ++n;
    x1 += x, y1 += y, xx += x * x, xy += x * y;
  }
  if (deviations.empty()) {
    result.undecided.emplace_back("the temporal noise: there are fewer than four frames");
    return;
  }
  const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
  std::ranges::nth_element(deviations, middle);
  std::string text = fmt::format("temporal noise of a pixel {:.3g} mm (median)", 1e3 * *middle);
  const double spread = n > 0 ? xx / n - x1 / n * (x1 / n) : 0;
  if (spread > 0.09) {  // variance of log(amplitude): standard deviation of a factor of at least 1.35
    const double slope = (xy / n - x1 / n * (y1 / n)) / spread;
    const char* kind = slope < -0.85 ? "read noise" : slope < -0.3 ? "shot noise" : "neither shot nor read noise";
    text += fmt::format(", proportional to amplitude^{:.2f}: {}", slope, kind);
  } else if (!o.amplitude.empty()) {
    result.undecided.emplace_back(
        "the kind of noise (shot or read noise): the amplitude varies too little within the image");
  }
  result.facts.push_back(text);
}

}  // namespace

void add_pixel_findings(Inspection& result) {
  add_shares(result);
  add_codes(result);
  add_bad_pixels(result);
  add_stripes(result);
  add_walk(result);
  add_noise(result);
}

}  // namespace tofgraph::inspection
