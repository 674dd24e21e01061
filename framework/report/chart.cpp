// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/chart.hpp"

#include "io/palettes.hpp"
#include "report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::report {
namespace {

using svg::Axis, svg::axis, svg::Frame, svg::letter, svg::line, svg::linked, svg::picture, svg::Range, svg::rule,
    svg::text, svg::tooltip;

std::string colour_of(std::size_t series) {
  return fmt::format(R"(class="s{}" color="{}")", series % io::line_colours.size(),
                     svg::colour_text(io::line_colours.at(series % io::line_colours.size())));
}

/// Attributes of a line.
std::string stroke_of(Series::Style style) {
  return fmt::format(R"(fill="none" stroke="currentColor" stroke-width="{}"{})",
                     style == Series::Style::thin_line ? 0.8 : 2,
                     style == Series::Style::dashes ? R"( stroke-dasharray="6 4")" : "");
}

std::string axes(const Frame& f, const Axis& x, const Axis& y, const Chart& chart) {
  std::string body;
  for (const auto& [tick, name] : y.named_ticks())
    body += line(f.left, y.at(tick), f.right, y.at(tick), rule) + text(f.left - 6, y.at(tick) + 4, name, "end");
  for (const auto& [tick, name] : x.named_ticks())
    body += line(x.at(tick), f.bottom, x.at(tick), f.bottom + 4, axis) + text(x.at(tick), f.bottom + 17, name);
  body += fmt::format(R"(<path {} d="M{} {}V{}H{}"/>)", axis, f.left, f.top, f.bottom, f.right);
  body += text((f.left + f.right) / 2, f.bottom + 34, chart.x_label) + text(8, f.top - 8, chart.y_label, "start");
  return body + text(8, 16, chart.title, "start", "font-weight=\"600\"");  // visible on narrow screens that scroll
}

std::string drawn(const Series& series, std::size_t number, const Axis& x, const Axis& y) {
  std::string path, points;
  bool joined = false;
  for (const Mark& m : series.marks) {
    const double px = x.at(m.x), py = y.at(m.y);
    if (!std::isfinite(px) || !std::isfinite(py)) {
      joined = false;
      continue;
    }
    path += fmt::format("{}{:.1f} {:.1f}", joined ? "L" : "M", px, py);
    joined = true;
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
    constexpr std::size_t many = 500;
    points += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="currentColor"/></g>)", px, py,
                          series.marks.size() > many ? 1.2 : 3.2);
  }
  if (!series.of_marks())  // a line does not cover marks below it
    points = fmt::format(R"(<path d="{}" {} pointer-events="none"/>)", path, stroke_of(series.style));
  return fmt::format("<g {}>{}</g>", colour_of(series.colour.value_or(number)), points);
}

constexpr double legend_row = 18, legend_sign = 25;  ///< px

/// Entries of a legend and their positions; rows end at the width.
struct Legend {
  std::string body;
  int rows = 0;
};

Legend legend(const Chart& chart, double left, double right, double y) {
  Legend result;
  double at = left;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& s = chart.series[i];
    if (s.name.empty()) continue;
    const double wide = legend_sign + letter * static_cast<double>(s.name.size());
    if (result.rows == 0 || at + wide > right) {
      ++result.rows;
      at = left;
    }
    const double bottom = y + legend_row * (result.rows - 1);
    const std::string sign =
        s.style == Series::Style::points
            ? fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3.2" fill="currentColor"/>)", at + 10, bottom - 4)
            : line(at, bottom - 4, at + 20, bottom - 4, stroke_of(s.style));
    result.body += fmt::format("<g {}>{}</g>", colour_of(s.colour.value_or(i)), sign) +
                   text(at + legend_sign, bottom, s.name, "start");
    at += wide + 17;
  }
  return result;
}

/// Ranges of a chart's axes.
struct Ranges {
  Range x, y;
  explicit Ranges(const Chart& c) {
    if (c.with_zero) y.add(0);
    for (const Series& s : c.series) {
      for (const Mark& m : s.marks) {
        if (!std::isfinite(m.x) || !std::isfinite(m.y) || (c.logarithmic_x && m.x <= 0)) continue;
        x.add(m.x);
        y.add(m.y - (c.with_zero ? 0 : m.error));
        y.add(m.y + m.error);
      }
    }
    if (!c.logarithmic_x && x.low > 0 && x.low < x.high / 10) x.low = 0;
  }
};

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
  const Axis x(range, left, width - 16.0);
  std::string body;
  for (const auto& [tick, name] : x.named_ticks())
    body += line(x.at(tick), top, x.at(tick), bottom, rule) + text(x.at(tick), bottom + 16, name);
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
  constexpr double below = 46;  // px: numbers and label of the x axis
  const Legend names = legend(c, 62, width - 14.0, 0);
  Frame f{62, 44, width - 14.0, height - below - legend_row * std::max(names.rows, 1)};
  const Ranges ranges(c);
  if (!std::isfinite(ranges.x.low))
    return picture(width, height, c.title,
                   text(8, 16, c.title, "start", "font-weight=\"600\"") + text(width / 2.0, height / 2.0, "no data"));
  if (c.equal_scales) {
    const double across = Axis(ranges.x, f.left, f.right).scale(), up = Axis(ranges.y, f.top, f.bottom).scale();
    if (across > up)
      f.right = f.left + (f.right - f.left) * up / across;
    else
      f.bottom = f.top + (f.bottom - f.top) * across / up;
  }
  const Axis x(ranges.x, f.left, f.right, c.logarithmic_x);
  const Axis y(ranges.y, c.y_down ? f.top : f.bottom, c.y_down ? f.bottom : f.top);
  std::string body = axes(f, x, y, c);
  for (std::size_t i = 0; i < c.series.size(); ++i) body += drawn(c.series[i], i, x, y);
  const double first = f.bottom + below + 8;
  return picture(width, height, c.title, body + legend(c, f.left, width - 14.0, first).body);
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

}  // namespace tofgraph::report
