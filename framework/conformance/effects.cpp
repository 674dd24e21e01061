// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks of effects: boards simulated with and without them.
#include "conformance/values.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <thread>

namespace tofgraph::conformance {
namespace {

using namespace simulation;
using graph::ParameterValues;
using Values = std::vector<tofgraph_value>;

/// Quantities that an effect may depend on: distances, angles, times, light.
struct Look {
  BoardPose board;
  double integration_time;  // s
  bool physical;
  const char* ambient;
};
constexpr Look looks[] = {{{1.3, 0.1, 0.05, 0.85}, 1e-3, false, "lamp"},
                          {{0.7, -0.2, 0.1, 0.3}, 4e-3, false, "dark"},
                          {{2.6, 0, 0.3, 0.85}, 4e-3, true, "lamp"}};

/// Effect with its parameters at their defaults, and the images in which it is observed.
class Bench {
 public:
  explicit Bench(const Subject& subject)
      : plugin_(subject.plugin()),
        camera_(camera_of(48, 64)),
        values_(values_of(plugin_, settings_of(subject))),
        pixels_(superpixels(camera_->view(), 8, 8)) {}

  std::span<const tofgraph_parameter> parameters() const { return plugin_.own_parameters; }
  const graph::Plugin& plugin() const { return plugin_; }
  double frequency() const { return camera_->view().modulation_frequency; }
  std::size_t pixels() const { return pixels_.size(); }

  /// Parameter values with each number set to the given descriptor field, where that is defined.
  Values at(double tofgraph_parameter::*which) const {
    Values values(values_.data(), values_.data() + plugin_.parameter_count);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const tofgraph_parameter& p = plugin_.own_parameters[i];
      if (p.kind == TOFGRAPH_KIND_NUMBER && std::isfinite(p.*which)) values[i].number = p.*which;
    }
    return values;
  }
  Values at_typical() const { return at(&tofgraph_parameter::typical); }
  /// Values for given settings. @throws Refusal
  ParameterValues with(const Settings& settings) const { return values_of(plugin_, settings); }

  EffectPtr make(const tofgraph_value* values) const {
    try {
      return std::make_shared<const simulation::Effect>(plugin_, values, camera_->view());
    } catch (const EffectError& error) {
      refuse(error.what(), error.defect);
    }
  }

  /// Taps of all acquisitions, P x (A, B) x pixels each. @throws Refusal
  std::vector<double> taps(const std::vector<EffectPtr>& effects) const {
    std::vector<double> all;
    for (const Look& look : looks) {
      Acquisition acquisition = acquisition_of(camera_->view(), look.integration_time);
      acquisition.condition.ambient = look.ambient;
      acquisition.condition.time_since_power_on = 600;
      acquisition.condition.velocity = 0.1;
      const ForwardModel model(camera_->view(), look.physical, effects);
      try {
        Expectation seen = model.expect(board_tracer(camera_->view().focal_length, look.board), acquisition, pixels_);
        if (model.has_readout()) model.read_out(acquisition, pixels_, seen.taps);
        all.insert(all.end(), seen.taps.begin(), seen.taps.end());
      } catch (const EffectError& error) {
        refuse(error.what(), error.defect);
      }
    }
    return all;
  }
  std::vector<double> taps(const Values& values) const { return taps({make(values.data())}); }
  std::vector<double> ideal() const { return taps(std::vector<EffectPtr>{}); }

 private:
  const graph::Plugin& plugin_;
  io::CameraPtr camera_;
  ParameterValues values_;
  Pixels pixels_;
};

/// @throws NotApplicable instead of Refusal
template <class Call> auto asked(Call&& call) {
  try {
    return call();
  } catch (const Refusal& refusal) {
    throw NotApplicable(refusal.what());
  }
}

bool has_size(const tofgraph_parameter& p) { return std::isfinite(p.typical); }

double norm(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::isfinite(value) ? value * value : 0;
  return std::sqrt(sum);
}

constexpr std::array observables = {"distance", "amplitude", "intensity", "null1", "null2"};
using Change = std::array<double, observables.size()>;

/// Signals of one pixel computed from four images, with the equations of the four-phase method.
struct Signal {
  std::complex<double> phasor;
  double intensity = 0, null1 = 0, null2 = 0;
};
Signal signal_of(std::span<const double> taps, std::size_t pixels, std::size_t i) {
  std::array<double, 4> c{};
  Signal signal;
  for (std::size_t k = 0; k < 4; ++k) {
    const double a = taps[2 * k * pixels + i], b = taps[(2 * k + 1) * pixels + i];
    c.at(k) = a - b;
    signal.intensity += (a + b) / 8;
    signal.null1 += (a - b) / 4;
    signal.null2 += (k % 2 == 0 ? a - b : b - a) / 4;
  }
  signal.phasor = {(c[0] - c[2]) / 2, (c[3] - c[1]) / 2};
  return signal;
}

/// Largest change of each observable: the phase in rad, the others relative to the amplitude or intensity.
Change change_between(const std::vector<double>& before, const std::vector<double>& after, std::size_t pixels) {
  Change change{};
  const std::size_t each = 8 * pixels;
  for (std::size_t look = 0; look * each < before.size(); ++look) {
    const std::span one(before.data() + look * each, each), other(after.data() + look * each, each);
    for (std::size_t i = 0; i < pixels; ++i) {
      const Signal a = signal_of(one, pixels, i), b = signal_of(other, pixels, i);
      const double size = std::abs(a.phasor);
      const Change here = {std::abs(std::arg(b.phasor * std::conj(a.phasor))), std::abs(std::abs(b.phasor) / size - 1),
                           std::abs(b.intensity / a.intensity - 1), std::abs(b.null1 - a.null1) / size,
                           std::abs(b.null2 - a.null2) / size};
      for (std::size_t o = 0; o < here.size(); ++o)
        if (std::isfinite(here.at(o))) change.at(o) = std::max(change.at(o), here.at(o));
    }
  }
  return change;
}

}  // namespace

std::string is_off(const Subject& subject) {
  const Bench bench(subject);
  const auto sizes = std::ranges::count_if(bench.parameters(), [](const auto& p) { return std::isfinite(p.off); });
  if (sizes == 0) throw NotApplicable("no parameter has a value at which it is off");
  const bool same = asked([&] { return bench.taps(bench.at(&tofgraph_parameter::off)) == bench.ideal(); });
  if (!same) throw Violation("it changes the light although all its sizes are off");
  return {};
}

std::string stays_finite(const Subject& subject) {
  const Bench bench(subject);
  const std::vector<double> ideal = bench.ideal();
  std::mt19937_64 random(subject.seed);
  std::size_t tried = 0, refused = 0;
  const auto try_with = [&](const std::function<EffectPtr()>& make, const std::string& where) {
    const std::string refusal = or_refuses([&] {
      const std::vector<double> taps = bench.taps({make()});
      for (std::size_t i = 0; i < taps.size(); ++i)
        if (std::isfinite(ideal[i]) && !std::isfinite(taps[i]))
          throw Violation(fmt::format("it turns finite light into NaN or infinity {}", where));
    });
    ++(refusal.empty() ? tried : refused);
  };
  const std::string typical = "at its typical values";
  try_with([&] { return bench.make(bench.at_typical().data()); }, typical);
  if (tried == 0) {
    EffectPtr made;
    try {
      made = bench.make(bench.at_typical().data());
      bench.taps({made});
    } catch (const Refusal& refusal) {
      if (made) throw Violation(fmt::format("it is made {} and then refuses the light: {}", typical, refusal.what()));
    }
  }
  for (const tofgraph_parameter& p : bench.parameters()) {
    std::vector<std::string> values = bounds_of(p);
    for (int draw = 0; draw < 8; ++draw) values.push_back(random_value(p, random));
    for (const std::string& value : values) {
      if (value.empty()) continue;
      const auto make = [&] { return bench.make(bench.with(settings_of(subject, {{p.name, value}})).data()); };
      try_with(make, fmt::format("at {}: {}", p.name, value));
    }
  }
  return fmt::format("{} values, {} refused", tried, refused);
}

std::string changes_smoothly(const Subject& subject) {
  const Bench bench(subject);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < bench.parameters().size(); ++i) {
    const tofgraph_parameter& p = bench.parameters()[i];
    if (!has_size(p)) continue;
    const auto slope = [&](double part) {
      const double step = part * std::abs(p.typical);
      Values low = bench.at_typical(), high = low;
      low[i].number = std::isnan(p.minimum) ? p.typical - step : std::max(p.minimum, p.typical - step);
      high[i].number = std::isnan(p.maximum) ? p.typical + step : std::min(p.maximum, p.typical + step);
      std::vector<double> change = bench.taps(high);
      const std::vector<double> before = bench.taps(low);
      for (std::size_t k = 0; k < change.size(); ++k)
        change[k] = (change[k] - before[k]) / (high[i].number - low[i].number);
      return change;
    };
    const auto [wide, narrow] = asked([&] { return std::pair(slope(1e-2), slope(1e-3)); });
    std::vector<double> rest = wide;
    for (std::size_t k = 0; k < rest.size(); ++k) rest[k] -= narrow[k];
    const double size = std::max(norm(wide), norm(narrow));
    const double rounding = 1e-9 * norm(bench.ideal()) / std::abs(p.typical);  // rounding error of the differences
    if (size <= rounding) continue;
    ++compared;
    if (norm(rest) > 0.05 * size + rounding)
      throw Violation(fmt::format(
          "the light does not change smoothly with '{}': differences over 1 % and 0.1 % of its typical size "
          "disagree by {:.0f} %, so a search goes astray",
          p.name, 100 * norm(rest) / size));
  }
  if (compared == 0) throw NotApplicable("no parameter of a typical size changes the light");
  return {};
}

std::string touches_what_it_says(const Subject& subject) {
  const Bench bench(subject);
  const std::vector<std::string> declared = graph::split_words(bench.plugin().effect->touches);
  const std::vector<double> ideal = bench.ideal(), seen = asked([&] { return bench.taps(bench.at_typical()); });
  const Change change = change_between(ideal, seen, bench.pixels());
  const double most = *std::ranges::max_element(change);
  if (most < 1e-9) throw NotApplicable("its typical values change nothing here");
  const auto declares = [&](const char* name) { return std::ranges::find(declared, name) != declared.end(); };
  std::string told;
  bool any = declares("variance");  // not visible in the expected light
  for (std::size_t o = 0; o < change.size(); ++o) {
    told += fmt::format("{}{} {:.2g}", told.empty() ? "" : ", ", observables.at(o), change.at(o));
    any = any || (declares(observables.at(o)) && change.at(o) > 1e-9);
    const bool light = (o == 1 || o == 2) && (declares("amplitude") || declares("intensity"));  // both are light
    if (!declares(observables.at(o)) && !light && change.at(o) > 0.5 * most)
      throw Violation(fmt::format("it changes '{}' as much as anything, and does not declare it", observables.at(o)));
  }
  if (!any) throw Violation(fmt::format("it changes nothing of what it declares: {}", bench.plugin().effect->touches));
  return told;
}

std::string effect_repeats(const Subject& subject) {
  const Bench bench(subject);
  const EffectPtr effect = asked([&] { return bench.make(bench.at_typical().data()); });
  const std::vector<double> expected = asked([&] { return bench.taps({effect}); });
  const auto same = [&](const std::vector<double>& taps) {
    return std::ranges::equal(taps, expected, [](double a, double b) { return a == b || (a != a && b != b); });
  };
  if (!same(bench.taps({effect})) || !same(bench.taps(bench.at_typical())))
    throw Violation("it gives other light for the same light");
  std::array<bool, 4> right{};
  std::vector<std::thread> threads;
  for (bool& result : right) {
    threads.emplace_back([&] {
      result = true;
      for (int round = 0; round < 10; ++round) result = same(bench.taps({effect})) && result;
    });
  }
  for (std::thread& thread : threads) thread.join();
  if (!std::ranges::all_of(right, [](bool r) { return r; }))
    throw Violation("it gives other light when it is applied on several threads at the same time: a data race");
  return {};
}

}  // namespace tofgraph::conformance
