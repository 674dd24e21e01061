// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/svg.hpp"

#include "config/base64.hpp"
#include "report/page.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::report::svg {

std::string colour_text(io::Colour colour) { return fmt::format("#{:06x}", colour); }

std::string text(double x, double y, std::string_view words, std::string_view anchor, const std::string& more) {
  return fmt::format(R"(<text class="ink" fill="#333333" x="{:.1f}" y="{:.1f}" text-anchor="{}"{}>{}</text>)", x, y,
                     anchor, more.empty() ? "" : " " + more, escaped(words));
}

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" {}/>)", x1, y1, x2, y2, style);
}

std::string tooltip(const std::string& title) { return title.empty() ? "" : "<title>" + escaped(title) + "</title>"; }

std::string linked(const std::optional<std::size_t>& condition) {
  return condition ? fmt::format(R"( data-condition="{}")", *condition) : "";
}

std::string picture(int width, int height, const std::string& title, const std::string& body) {
  // Charts wider than a phone are not scaled below the limit of legibility: they scroll.
  constexpr int narrow = 400;
  constexpr double legible = 0.85;
  return fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" class="chart" role="img" aria-label="{}" width="{}" height="{}"{} )"
      R"(viewBox="0 0 {} {}" font-family="system-ui, sans-serif" font-size="12">)"
      R"(<rect class="paper" width="100%" height="100%" fill="#ffffff"/>{}</svg>)",
      escaped(title), width, height,
      width > narrow ? fmt::format(" style=\"min-width:{:.0f}px\"", legible * width) : "", width, height, body);
}

std::string image(double x, double y, double width, double height, std::span<const std::uint8_t> rgb,
                  std::size_t columns, std::size_t rows) {
  png_image picture{};
  picture.version = PNG_IMAGE_VERSION;
  picture.width = static_cast<png_uint_32>(columns);
  picture.height = static_cast<png_uint_32>(rows);
  picture.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(picture);
  std::string png(bytes, '\0');
  if (png_image_write_to_memory(&picture, png.data(), &bytes, 0, rgb.data(), 0, nullptr) == 0)
    throw std::runtime_error(
        fmt::format("libpng cannot write an image of {} x {} px: {}", columns, rows, picture.message));
  return fmt::format(R"(<image x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" preserveAspectRatio="none" )"
                     R"(style="image-rendering:pixelated" href="data:image/png;base64,{}"/>)",
                     x, y, width, height, config::base64(png.data(), bytes));
}

void Range::add(double value) {
  if (!std::isfinite(value)) return;
  low = std::min(low, value);
  high = std::max(high, value);
}

Axis::Axis(Range range, double from, double to, bool logarithmic)
    : low_(logarithmic ? std::log10(range.low) : range.low),
      high_(logarithmic ? std::log10(range.high) : range.high),
      from_(from),
      to_(to),
      logarithmic_(logarithmic) {
  if (!(low_ < high_)) {
    const double half = low_ == 0 || !std::isfinite(low_) ? 1 : std::abs(low_) / 2;
    if (!std::isfinite(low_)) low_ = 0;
    high_ = low_ + half;
    low_ -= half;
  }
  const double margin = 0.04 * (high_ - low_);
  if (logarithmic || low_ != 0) low_ -= margin;
  high_ += margin;
}

double Axis::at(double value) const {
  return from_ + ((logarithmic_ ? std::log10(value) : value) - low_) / (high_ - low_) * (to_ - from_);
}

std::vector<double> Axis::ticks() const {
  constexpr double steps[] = {1, 2, 5};
  std::vector<double> all;
  if (logarithmic_) {
    for (double power = std::floor(low_); power <= high_; ++power) {
      for (const double digit : steps) {
        const double value = digit * std::pow(10, power), place = std::log10(value);
        if (place >= low_ && place <= high_ && (digit == 1 || high_ - low_ < 3)) all.push_back(value);
      }
    }
    return all;
  }
  const double rough = (high_ - low_) / 5, power = std::pow(10, std::floor(std::log10(rough)));
  const auto* digit = std::ranges::find_if(steps, [&](double d) { return d * power >= rough; });
  const double step = (digit != std::end(steps) ? *digit : 10) * power;
  for (double k = std::ceil(low_ / step); k * step <= high_; ++k) all.push_back(k == 0 ? 0 : k * step);
  return all;
}

std::vector<std::pair<double, std::string>> Axis::named_ticks() const {
  const std::vector<double> all = ticks();
  int digits = 4;
  if (!logarithmic_ && all.size() > 1) {
    const double step = all[1] - all[0], largest = std::max(std::abs(all.front()), std::abs(all.back()));
    digits = std::max(digits, static_cast<int>(std::ceil(std::log10(largest / step) + 0.01)) + 1);
  }
  std::vector<std::pair<double, std::string>> named;
  for (const double tick : all) named.emplace_back(tick, fmt::format("{:.{}g}", tick, digits));
  return named;
}

}  // namespace tofgraph::report::svg
