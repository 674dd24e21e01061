// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/plausibility.hpp"

#include "config/quantity.hpp"

#include <tofgraph/physics/constants.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

namespace tofgraph::io {
namespace {

using config::format_quantity;

constexpr double zero_celsius_in_k = 273.15;  // K

struct Interval {
  double least, most;

  bool contains(double value) const { return value >= least && value <= most; }
};

/// Unit in which a value may have been written, and its size in the expected unit.
struct UnitGuess {
  const char* name;
  double size;
};

/// Units that would make the number plausible: "in us (1000 us = 1 ms)"; empty: none.
std::string likely_units(double number, const char* unit, Interval expected, std::initializer_list<UnitGuess> units) {
  std::string text;
  for (const UnitGuess& guess : units) {
    if (!expected.contains(number * guess.size)) continue;
    text += fmt::format("{}in {} ({:.6g} {} = {})", text.empty() ? "" : " or ", guess.name, number, guess.name,
                        format_quantity(number * guess.size, unit));
  }
  return text;
}

/// Second half of the sentence.
std::string likely(const std::string& units, const char* expected_unit) {
  return units.empty() ? std::string() : fmt::format(": it was probably written {}, not in {}", units, expected_unit);
}

std::string range_text(Interval range, const char* unit) {
  return fmt::format("{} to {}", format_quantity(range.least, unit), format_quantity(range.most, unit));
}

/// Clock value of each frame, s.
using ClockTimes = std::vector<double>;

/// First frame whose time is before that of its predecessor.
std::optional<std::size_t> first_step_back(const ClockTimes& times) {
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] < times[i - 1]) return i;
  return std::nullopt;
}

double median_step(const ClockTimes& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

std::string runs_back(const char* name, std::size_t frame, const std::string& before, const std::string& after) {
  return fmt::format("the {} runs back: {} at frame {}, {} at frame {}", name, before, frame - 1, after, frame);
}

std::string fast_frames(double step, double time, double rate) {
  const bool exposed = step < time;
  if (!exposed && !(step < 0.01 / rate)) return {};
  const std::string units = likely_units(step * 1e9, "s", {std::isfinite(rate) ? 0.3 / rate : 1e-3, 20},
                                         {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}});
  const std::string why = exposed ? fmt::format("each is exposed for {}", format_quantity(time, "s"))
                                  : fmt::format("the camera's frame rate is {}", format_quantity(rate, "Hz"));
  return fmt::format("the time stamps put {} between frames, but {}{}", format_quantity(step, "s"), why,
                     likely(units, "ns"));
}

/// True if time stamps are recorded. 0 means unknown, but a clock may start at 0.
bool has_time_stamps(std::span<const tofgraph_metadata> frames) {
  return frames.size() > 1 &&
         std::ranges::none_of(frames.subspan(1), [](const tofgraph_metadata& f) { return f.timestamp_ns == 0; });
}

std::string time_stamp_doubt(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera) {
  if (!has_time_stamps(frames)) return {};
  ClockTimes times;
  for (const tofgraph_metadata& frame : frames) {
    times.push_back(static_cast<double>(frame.timestamp_ns - frames[0].timestamp_ns) * 1e-9);
  }
  if (times.size() < 2) return {};
  if (const auto back = first_step_back(times)) {
    const auto shown = [&](std::size_t i) { return fmt::format("{} ns", frames[i].timestamp_ns); };
    return runs_back("clock of the time stamps", *back, shown(*back - 1), shown(*back));
  }
  const double step = median_step(times);
  if (times.back() == 0)
    return fmt::format("the clock of the time stamps does not advance: {} ns at all {} frames", frames[0].timestamp_ns,
                       frames.size());
  const double rate = camera != nullptr ? camera->frame_rate : std::nan("");
  const double time = frames[0].integration_time;
  const bool doubtful = !integration_time_doubt(time, camera).empty();  // reported separately
  return step > 0 ? fast_frames(step, doubtful ? std::nan("") : time, rate) : std::string();
}

/// Median of the positive finite values, including those that are implausibly long; NaN: there are none.
double median_of_positive(std::vector<float> values) {
  std::erase_if(values, [](float v) { return !(v > 0 && std::isfinite(v)); });
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::string power_on_doubt(std::span<const tofgraph_metadata> frames) {
  ClockTimes times;
  for (const tofgraph_metadata& frame : frames) {
    if (std::isnan(frame.time_since_power_on)) return {};
    times.push_back(frame.time_since_power_on);
    if (times.back() < 0)
      return fmt::format("the time since power on is {} at frame {}, expected 0 s or more",
                         format_quantity(times.back(), "s"), times.size() - 1);
  }
  if (times.size() < 2) return {};
  if (const auto back = first_step_back(times))
    return runs_back("time since power on", *back, format_quantity(times[*back - 1], "s"),
                     format_quantity(times[*back], "s"));
  const double span = times.back() - times.front();
  const double stamps = static_cast<double>(frames.back().timestamp_ns - frames.front().timestamp_ns) * 1e-9;
  if (!(stamps > 0) || !has_time_stamps(frames)) return {};
  const auto same = [&](double factor) { return std::abs(span / stamps / factor - 1) < 0.05; };
  const char* unit = same(1e3) ? "ms" : same(1e6) ? "us" : nullptr;
  if (unit == nullptr) return {};
  return fmt::format(
      "the time since power on grows by {}, the time stamps by {}: it was probably written in {}, not in s",
      format_quantity(span, "s"), format_quantity(stamps, "s"), unit);
}

}  // namespace

std::string frequency_doubt(double frequency, const tofgraph_camera* camera) {
  if (std::isnan(frequency)) return {};
  const double nominal = camera != nullptr ? camera->modulation_frequency : std::nan("");
  const bool known = camera != nullptr && nominal > 0;
  const Interval expected = known ? Interval{nominal / 100, nominal * 100} : Interval{1e5, 1e9};
  if (expected.contains(frequency)) return {};
  const Interval near = known ? Interval{nominal / 5, nominal * 5} : Interval{1e6, 3e8};
  const std::string units =
      likely_units(frequency, "Hz", near, {{"kHz", 1e3}, {"MHz", 1e6}, {"GHz", 1e9}, {"THz", 1e12}});
  const std::string other =
      known ? fmt::format("that of the camera '{}' is {}", camera->name, format_quantity(nominal, "Hz"))
            : fmt::format("expected {}", range_text(expected, "Hz"));
  return fmt::format("the modulation frequency is {}, {}{}", format_quantity(frequency, "Hz"), other,
                     likely(units, "Hz"));
}

std::string integration_time_doubt(double time, const tofgraph_camera* camera) {
  if (std::isnan(time)) return {};
  const bool known = camera != nullptr && camera->integration_time[0] > 0 && camera->integration_time[1] > 0;
  const Interval valid =
      known ? Interval{camera->integration_time[0], camera->integration_time[1]} : Interval{1e-6, 0.5};
  const Interval expected = known ? Interval{valid.least / 10, valid.most * 10} : valid;
  if (expected.contains(time)) return {};
  const std::string units =
      likely_units(time, "s", known ? valid : Interval{1e-5, 0.1}, {{"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  const std::string other = known ? fmt::format("the camera '{}' allows {}", camera->name, range_text(valid, "s"))
                                  : fmt::format("expected {}", range_text(valid, "s"));
  return fmt::format("the integration time is {}, {}{}", format_quantity(time, "s"), other, likely(units, "s"));
}

std::string temperature_doubt(double temperature) {
  const double celsius = temperature - zero_celsius_in_k;
  const Interval expected{-60, 120};
  if (std::isnan(temperature) || expected.contains(celsius)) return {};
  const char* unit = expected.contains(celsius - zero_celsius_in_k) ? "K"
                     : expected.contains(celsius / 1000)            ? "thousandths of a degree"
                                                                    : nullptr;
  return fmt::format("the temperature is {:.6g} degC, expected {} to {} degC{}", celsius, expected.least, expected.most,
                     unit != nullptr ? fmt::format(": it was probably written in {}, not in degC", unit) : "");
}

double expected_range(std::span<const tofgraph_exposure> exposures, double recorded, const tofgraph_camera* camera) {
  const double nominal = camera != nullptr ? camera->modulation_frequency : std::nan("");
  double lowest = std::isnan(recorded) || !frequency_doubt(recorded, camera).empty() ? nominal : recorded;
  for (const tofgraph_exposure& exposure : exposures) {
    if (exposure.frequency > 0) lowest = std::fmin(lowest, exposure.frequency);
  }
  return lowest > 0 ? physics::unambiguous_range(lowest) : std::nan("");
}

std::string length_doubt(const std::string& channel, std::vector<float> lengths, double unambiguous_range) {
  const double median = median_of_positive(std::move(lengths));
  if (std::isnan(median)) return {};
  const bool known = unambiguous_range > 0;
  const Interval expected{5e-3, known ? 10 * unambiguous_range : 1e3};
  if (expected.contains(median)) return {};
  const Interval near{0.05, known ? unambiguous_range : 50};
  const std::string units =
      likely_units(median, "m", near, {{"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"inches", 0.0254}, {"km", 1e3}});
  const std::string other = known ? fmt::format("the unambiguous range is {}", format_quantity(unambiguous_range, "m"))
                                  : fmt::format("expected {}", range_text(expected, "m"));
  return fmt::format("the median of {} is {}, {}{}", channel, format_quantity(median, "m"), other, likely(units, "m"));
}

std::string range_doubt(const std::string& channel, std::vector<float> lengths, double measuring_range,
                        double unambiguous_range) {
  std::erase_if(lengths, [](float v) { return !(v > 0 && std::isfinite(v)); });
  std::ranges::sort(lengths);
  const bool stated = std::isfinite(measuring_range);
  // A data sheet states where the accuracy holds; lengths beyond it can be measured up to the unambiguous range.
  const bool ambiguous = stated && unambiguous_range >= measuring_range && unambiguous_range < 2 * measuring_range;
  const double limit = ambiguous ? unambiguous_range : 2 * (stated ? measuring_range : unambiguous_range);
  if (!(limit > 0) || lengths.empty()) return {};
  const auto within = std::ranges::upper_bound(lengths, static_cast<float>(limit)) - lengths.begin();
  const double beyond = 1 - static_cast<double>(within) / static_cast<double>(lengths.size());
  const double high = lengths[lengths.size() - 1 - lengths.size() / 100];
  if (beyond < 0.05 || high < 1.1 * limit) return {};  // an offset may exceed the limit slightly
  return fmt::format(
      "{:.0f} % of the lengths of {} are beyond {}, {}; 99 % are up to {}: the unit is probably smaller by "
      "a factor of {:.2g} or more, e.g. 0.25 mm or 0.1 mm instead of 1 mm",
      100 * beyond, channel, format_quantity(limit, "m"),
      ambiguous ? "the unambiguous range of the camera"
      : stated  ? "twice the measuring_range of the camera"
                : "twice its unambiguous range",
      format_quantity(high, "m"), high / limit);
}

std::vector<std::string> clock_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera) {
  std::vector<std::string> doubts = {time_stamp_doubt(frames, camera), power_on_doubt(frames)};
  std::erase(doubts, std::string());
  return doubts;
}

std::vector<std::string> metadata_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera) {
  std::array<std::string, 3> first;
  for (const tofgraph_metadata& frame : frames) {
    if (first[0].empty()) first[0] = frequency_doubt(frame.modulation_frequency, camera);
    if (first[1].empty()) first[1] = integration_time_doubt(frame.integration_time, camera);
    if (first[2].empty()) first[2] = temperature_doubt(frame.temperature);
  }
  std::vector<std::string> doubts(first.begin(), first.end());
  std::erase(doubts, std::string());
  std::ranges::move(clock_doubts(frames, camera), std::back_inserter(doubts));
  return doubts;
}

}  // namespace tofgraph::io
