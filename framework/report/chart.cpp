// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/chart.hpp"

#include "io/palettes.hpp"
#include "report/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::report {
namespace {

constexpr double font = 12, letter = 6.6;  ///< px: font size, and average width of a letter
// Attributes apply to stand-alone pictures; the style of a page overrides them with its own colours.
constexpr const char* ink = R"(class="ink" fill="#333333")";
constexpr const char* rule = R"(class="rule" stroke="#dddddd")";
constexpr const char* axis = R"(class="axis" stroke="#555555" fill="none")";

std::string colour_text(io::Colour colour) { return fmt::format("#{:06x}", colour); }
std::string colour_of(std::size_t series) {
  return fmt::format(R"(class="s{}" color="{}")", series % io::line_colours.size(),
                     colour_text(io::line_colours.at(series % io::line_colours.size())));
}

std::string text(double x, double y, std::string_view words, std::string_view anchor = "middle",
                 const std::string& more = "") {
  return fmt::format(R"(<text {} x="{:.1f}" y="{:.1f}" text-anchor="{}"{}>{}</text>)", ink, x, y, anchor,
                     more.empty() ? "" : " " + more, escaped(words));
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
      R"(viewBox="0 0 {} {}" font-family="system-ui, sans-serif" font-size="{}">)"
      R"(<rect class="paper" width="100%" height="100%" fill="#ffffff"/>{}</svg>)",
      escaped(title), width, height,
      width > narrow ? fmt::format(" style=\"min-width:{:.0f}px\"", legible * width) : "", width, height, font, body);
}

/// Axis: maps values to pixels, with ticks at round numbers.
struct Axis {
  double low, high, from, to;

  Axis(double least, double greatest, double first, double last) : low(least), high(greatest), from(first), to(last) {
    if (!(low < high)) {
      const double half = low == 0 || !std::isfinite(low) ? 1 : std::abs(low) / 2;
      if (!std::isfinite(low)) low = 0;
      high = low + half;
      low -= half;
    }
    const double margin = 0.04 * (high - low);
    if (low != 0) low -= margin;
    high += margin;
  }
  double at(double value) const { return from + (value - low) / (high - low) * (to - from); }
  double step() const {
    const double rough = (high - low) / 5, power = std::pow(10, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor * power >= rough) return factor * power;
    }
    return 10 * power;
  }
  std::vector<double> ticks() const {
    std::vector<double> all;
    for (double k = std::ceil(low / step()); k * step() <= high; ++k) all.push_back(k == 0 ? 0 : k * step());
    return all;
  }
};

/// Minimum and maximum of the finite numbers.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

struct Frame {
  double left, top, right, bottom;
};

std::string axes(const Frame& f, const Axis& x, const Axis& y, const Chart& chart) {
  std::string body;
  for (const double tick : y.ticks())
    body += line(f.left, y.at(tick), f.right, y.at(tick), rule) +
            text(f.left - 6, y.at(tick) + 4, fmt::format("{:.4g}", tick), "end");
  for (const double tick : x.ticks())
    body += line(x.at(tick), f.bottom, x.at(tick), f.bottom + 4, axis) +
            text(x.at(tick), f.bottom + 17, fmt::format("{:.4g}", tick));
  body += fmt::format(R"(<path {} d="M{} {}V{}H{}"/>)", axis, f.left, f.top, f.bottom, f.right);
  body += text((f.left + f.right) / 2, f.bottom + 34, chart.x_label) + text(8, f.top - 8, chart.y_label, "start");
  return body + text(8, 16, chart.title, "start", "font-weight=\"600\"");  // visible on narrow screens that scroll
}

std::string drawn(const Series& series, std::size_t number, const Axis& x, const Axis& y) {
  std::string path, points;
  for (const Mark& m : series.marks) {
    if (!std::isfinite(m.x) || !std::isfinite(m.y)) continue;
    const double px = x.at(m.x), py = y.at(m.y);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", px, py);
    if (!series.of_marks()) continue;
    points += fmt::format("<g{}>{}", linked(m.condition), tooltip(m.title));
    if (series.style == Series::Style::ticks) {
      points += fmt::format(R"(<path d="M{:.1f} {:.1f}h14" fill="none" stroke="currentColor" stroke-width="2.5"/></g>)",
                            px - 7, py);
      continue;
    }
    if (m.error > 0)
      points += fmt::format(R"(<path d="M{:.1f} {:.1f}V{:.1f}" fill="none" stroke="currentColor"/>)", px,
                            y.at(m.y - m.error), y.at(m.y + m.error));
    points += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3.2" fill="currentColor"/></g>)", px, py);
  }
  if (!series.of_marks())
    points = fmt::format(R"(<path d="{}" fill="none" stroke="currentColor" stroke-width="2"{}/>)", path,
                         series.style == Series::Style::dashes ? " stroke-dasharray=\"6 4\"" : "");
  return fmt::format("<g {}>{}</g>", colour_of(series.colour.value_or(number)), points);
}

std::string legend(const Chart& chart, double left, double y) {
  std::string body;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& s = chart.series[i];
    if (s.name.empty()) continue;
    const std::string sign =
        s.style == Series::Style::points
            ? fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3.2" fill="currentColor"/>)", left + 10, y - 4)
            : line(left, y - 4, left + 20, y - 4,
                   fmt::format("stroke=\"currentColor\" stroke-width=\"2\"{}",
                               s.style == Series::Style::dashes ? " stroke-dasharray=\"6 4\"" : ""));
    body += fmt::format("<g {}>{}</g>", colour_of(s.colour.value_or(i)), sign) + text(left + 25, y, s.name, "start");
    left += 42 + letter * static_cast<double>(s.name.size());
  }
  return body;
}

/// Space for the longest label of the rows.
double room_for(const std::vector<Span>& spans) {
  std::size_t longest = 0;
  for (const Span& span : spans) longest = std::max(longest, span.label.size());
  return std::min(12 + letter * static_cast<double>(longest), 460.0);
}

/// Rows with a common axis; `mark` draws a row at its height.
template <class F> std::string rows_of(const std::vector<Span>& spans, const std::string& x_label,
                                       const std::vector<double>& references, int width, std::size_t colour, F mark) {
  constexpr double row = 22, top = 8;
  Range range;
  for (const double r : references) range.add(r);
  for (const Span& s : spans) {
    for (const double v : {s.value, s.low, s.high}) range.add(v);
  }
  const double left = room_for(spans), bottom = top + row * static_cast<double>(spans.size());
  const Axis x(range.low, range.high, left, width - 16.0);
  std::string body;
  for (const double tick : x.ticks())
    body +=
        line(x.at(tick), top, x.at(tick), bottom, rule) + text(x.at(tick), bottom + 16, fmt::format("{:.4g}", tick));
  for (const double r : references)
    body += line(x.at(r), top, x.at(r), bottom, std::string(axis) + " stroke-dasharray=\"3 3\"");
  body += text((left + width) / 2, bottom + 33, x_label);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const double y = top + row * (static_cast<double>(i) + 0.5);
    body += text(left - 8, y + 4, spans[i].label, "end");
    body += fmt::format("<g{} {}>{}{}</g>", linked(spans[i].condition), colour_of(colour), tooltip(spans[i].title),
                        mark(spans[i], x, y));
  }
  return picture(width, static_cast<int>(bottom) + 42, x_label, body);
}

constexpr double before_scale = 10, of_scale = 16;  ///< px: between a map and its colour bar, and its numbers

std::string scale(const FieldMap& map, double left, double top, double bottom) {
  constexpr int steps = 24;
  std::string body;
  const double height = (bottom - top) / steps;
  for (int k = 0; k < steps; ++k)
    body += fmt::format(R"(<rect x="{:.1f}" y="{:.2f}" width="12" height="{:.2f}" fill="{}"/>)", left, top + height * k,
                        height + 0.3, colour_text(io::colour_at(io::signed_colours, 1 - (k + 0.5) / steps)));
  body += text(left + of_scale, top + 10, plain(map.limit, 2, true), "start") +
          text(left + of_scale, (top + bottom) / 2 + 4, "0", "start") +
          text(left + of_scale, bottom, plain(-map.limit, 2, true), "start");
  return body + text(left + 6, top - 8, map.unit, "middle");
}

}  // namespace

std::string plain(double value, int digits, bool sign) {
  constexpr double smallest = 1e-4;
  if (!std::isfinite(value)) return "-";
  if (std::abs(value) < smallest) return "0";
  const auto behind = [&](double of) { return digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(of)))); };
  const double unit = std::pow(10, -behind(value)), rounded = std::round(value / unit) * unit;
  const int places = std::max(behind(rounded), 0);  // 9.99 is rounded to 10.0
  return sign ? fmt::format("{:+.{}f}", rounded, places) : fmt::format("{:.{}f}", rounded, places);
}

std::string chart(const Chart& c, int width, int height) {
  const Frame f{62, 44, width - 14.0, height - 64.0};
  Range xs, ys;
  if (c.with_zero) ys.add(0);
  for (const Series& s : c.series) {
    for (const Mark& m : s.marks) {
      if (!std::isfinite(m.y)) continue;
      xs.add(m.x);
      ys.add(m.y - (c.with_zero ? 0 : m.error));
      ys.add(m.y + m.error);
    }
  }
  const Axis x(xs.low, xs.high, f.left + 8, f.right), y(ys.low, ys.high, f.bottom, f.top);
  std::string body = axes(f, x, y, c);
  for (std::size_t i = 0; i < c.series.size(); ++i) body += drawn(c.series[i], i, x, y);
  return picture(width, height, c.title, body + legend(c, f.left, height - 10.0));
}

std::string forest(const std::vector<Span>& spans, const std::string& x_label, const std::vector<double>& references,
                   int width) {
  return rows_of(spans, x_label, references, width, of_extended, [](const Span& s, const Axis& x, double y) {
    return fmt::format(R"(<path d="M{:.1f} {:.1f}H{:.1f}" stroke="currentColor" stroke-width="2" fill="none"/>)"
                       R"(<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="currentColor"/>)",
                       x.at(s.low), y, x.at(s.high), x.at(s.value), y);
  });
}

std::string bars(const std::vector<Span>& spans, const std::string& x_label, int width) {
  return rows_of(spans, x_label, {0}, width, of_neither, [](const Span& s, const Axis& x, double y) {
    const double from = std::min(x.at(0), x.at(s.value)), to = std::max(x.at(0), x.at(s.value));
    return fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="14" fill="currentColor"/>)", from, y - 7,
                       std::max(to - from, 1.0));
  });
}

std::string field_map(const FieldMap& map, int width, int height) {
  std::size_t longest = 0, widest = 0;
  for (const std::string& name : map.y_names) longest = std::max(longest, name.size());
  for (const std::string& name : map.x_names) widest = std::max(widest, name.size());
  const double left = 10 + letter * static_cast<double>(longest) + (map.y_label.empty() ? 0 : 4);
  const double below =
      (widest > 0 ? 14 + 0.6 * letter * static_cast<double>(widest) : 8) + (map.x_label.empty() ? 0 : 16);
  const double numbers = letter * static_cast<double>(std::max<std::size_t>(plain(map.limit, 2, true).size(), 3));
  const Frame f{left, 42, width - before_scale - of_scale - numbers - 6, height - below};
  const double w = (f.right - f.left) / static_cast<double>(std::max<std::size_t>(map.columns, 1)),
               h = (f.bottom - f.top) / static_cast<double>(std::max<std::size_t>(map.rows, 1));
  std::string body = text(width / 2.0, 16, map.title, "middle", "font-weight=\"600\"");
  for (std::size_t k = 0; k < map.fields.size(); ++k) {
    const Field& field = map.fields[k];
    const std::size_t row = k / map.columns, column = k % map.columns;
    const double x = f.left + w * static_cast<double>(column), y = f.top + h * static_cast<double>(row);
    const bool there = std::isfinite(field.value);
    const io::Colour colour =
        there ? io::colour_at(io::signed_colours, 0.5 + field.value / (2 * map.limit)) : io::invalid_colour;
    body += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" )"
                        R"(shape-rendering="crispEdges" fill="{}"{}>{}</rect>)",
                        x, y, w + 0.3, h + 0.3, colour_text(colour), linked(field.condition), tooltip(field.title));
    if (map.write_values && there)
      body += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle" font-size="11" fill="{}">{:.2f}</text>)",
                          x + w / 2, y + h / 2 + 4, std::abs(field.value) > 0.7 * map.limit ? "#ffffff" : "#222222",
                          std::abs(field.value) < 0.005 ? 0 : field.value);  // avoids "-0.00"
  }
  const auto every = [](std::size_t count, double size) {  // skips names that would overlap
    return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(14.0 / size * (count > 0 ? 1 : 0))));
  };
  for (std::size_t r = 0; r < map.y_names.size(); r += every(map.rows, h))
    body += text(f.left - 5, f.top + h * (static_cast<double>(r) + 0.5) + 4, map.y_names[r], "end");
  for (std::size_t c = 0; c < map.x_names.size(); c += every(map.columns, w)) {
    const double x = f.left + w * (static_cast<double>(c) + 0.5), y = f.bottom + 12;
    body += text(x, y, map.x_names[c], "end", fmt::format("transform=\"rotate(-40 {:.1f} {:.1f})\"", x, y));
  }
  if (!map.x_label.empty()) body += text((f.left + f.right) / 2, height - 6.0, map.x_label);
  if (!map.y_label.empty()) body += text(f.left - 5, f.top - 8, map.y_label, "end");
  return picture(width, height, map.title, body + scale(map, f.right + before_scale, f.top, f.bottom));
}

}  // namespace tofgraph::report
