// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/patterns.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

namespace tofgraph::diagnosis {
namespace {

/// Value at a superpixel in a condition; NaN: unknown.
using Covariate = std::function<double(std::size_t condition, std::size_t superpixel)>;
struct Axis {
  std::string name;
  std::vector<Covariate> columns;
};

constexpr const char* lens_axis = "lens";
constexpr double basis_unit = 1e-3;

/// Legendre polynomials P1 .. P4.
double legendre(int degree, double u) {
  switch (degree) {
    case 1:
      return u;
    case 2:
      return (3 * u * u - 1) / 2;
    case 3:
      return u * (5 * u * u - 3) / 2;
    default:
      return (35 * u * u * u * u - 30 * u * u + 3) / 8;
  }
}

class Axes {
 public:
  explicit Axes(const Design& design) : design_(design) {}

  std::vector<Axis> all() {
    const auto condition = [this](auto member) -> Covariate {
      return [this, member](std::size_t i, std::size_t) { return design_.conditions()[i].*member; };
    };
    axes_.push_back({everywhere, {[](std::size_t, std::size_t) { return 1.0; }}});
    const Covariate board = condition(&io::Condition::board_distance);
    smooth("board distance", board);
    const Covariate time = [this](std::size_t i, std::size_t) {
      return std::log(design_.conditions()[i].integration_time);
    };
    smooth("integration time", time);
    const Covariate bright = [this](std::size_t i, std::size_t s) {
      return std::log(std::abs(design_.ideal(i)[s].phasor));
    };
    smooth("amplitude", bright);
    smooth("time since power-on", condition(&io::Condition::time_since_power_on));
    if (design_.tells_order())
      smooth("order measured",
             [this](std::size_t i, std::size_t) { return static_cast<double>(*design_.conditions()[i].order); });
    smooth("tilt about x", condition(&io::Condition::board_tilt_x));
    smooth("tilt about y", condition(&io::Condition::board_tilt_y));
    smooth("temperature", condition(&io::Condition::temperature));
    smooth("velocity", condition(&io::Condition::velocity));
    const Covariate x = [this](std::size_t, std::size_t s) { return centred(s, 0); };
    const Covariate y = [this](std::size_t, std::size_t s) { return centred(s, 1); };
    const Covariate radius = [this](std::size_t, std::size_t s) { return std::hypot(centred(s, 0), centred(s, 1)); };
    smooth("x", x);
    smooth("y", y);
    smooth("radius", radius);
    smooth("incidence", [this](std::size_t i, std::size_t s) { return design_.incidence(i, s); });
    levels("target", [](const io::Condition& c) { return c.target; });
    levels("sources", [](const io::Condition& c) { return fmt::format("{}", fmt::join(c.sources, " ")); });
    levels("ambient", [](const io::Condition& c) { return c.ambient; });
    levels("roll", [](const io::Condition& c) { return fmt::format("{:.3f}", c.roll); });
    const auto capped = [this](std::size_t i, std::size_t) { return design_.shows_board(i) ? 0.0 : 1.0; };
    if (std::ranges::any_of(design_.conditions(), &io::Condition::is_capped)) axes_.push_back({lens_axis, {capped}});
    levels("rail", [](const io::Condition& c) { return c.rail; });
    levels("reference", [](const io::Condition& c) { return c.reference; });
    for (int cycles = 1; cycles <= settings.max_cycles; ++cycles) cycle(cycles);
    product("board distance and x", board, x);
    product("board distance and y", board, y);
    product("board distance and radius", board, radius);
    product("board distance and integration time", board, time);
    product("amplitude and integration time", bright, time);
    return std::move(axes_);
  }

 private:
  double centred(std::size_t s, std::size_t axis) const {
    const double size = axis == 0 ? design_.camera().width : design_.camera().height;
    return 2 * design_.pixels().at[2 * s + axis] / (size - 1) - 1;
  }

  /// The covariate scaled to -1 .. 1; 0 where unknown. @param levels number of distinct values, at most one more than
  /// the highest degree; 1: it does not vary
  Covariate scaled(const Covariate& raw, std::size_t& levels) const {
    std::set<double> values;
    for (std::size_t i = 0; i < design_.size(); ++i) {
      for (std::size_t s = 0; s < design_.superpixels() && design_.shows_board(i); ++s) {
        const double value = raw(i, s);
        if (std::isfinite(value)) values.insert(value);
      }
    }
    const double least = values.empty() ? 0 : *values.begin(), most = values.empty() ? 0 : *values.rbegin();
    levels = most - least > 1e-9 * std::abs(most) ? std::min<std::size_t>(values.size(), settings.max_legendre + 1) : 1;
    return [raw, least, most](std::size_t i, std::size_t s) {
      const double value = raw(i, s);
      return std::isfinite(value) ? 2 * (value - least) / (most - least) - 1 : 0;
    };
  }

  void smooth(const char* name, const Covariate& raw) {
    std::size_t levels = 0;
    const Covariate u = scaled(raw, levels);
    if (levels < 2) return;
    Axis axis{name, {}};
    for (int degree = 1; degree < static_cast<int>(levels); ++degree)
      axis.columns.push_back([u, degree](std::size_t i, std::size_t s) { return legendre(degree, u(i, s)); });
    axes_.push_back(std::move(axis));
  }

  void product(const char* name, const Covariate& first, const Covariate& second) {
    std::size_t first_levels = 0, second_levels = 0;
    const Covariate u = scaled(first, first_levels), v = scaled(second, second_levels);
    if (first_levels < 2 || second_levels < 2) return;
    Axis axis{name, {}};
    for (int p = 1; p <= 2 && p < static_cast<int>(first_levels); ++p) {
      for (int q = 1; q <= 2 && q < static_cast<int>(second_levels); ++q)
        axis.columns.push_back(
            [u, v, p, q](std::size_t i, std::size_t s) { return legendre(p, u(i, s)) * legendre(q, v(i, s)); });
    }
    axes_.push_back(std::move(axis));
  }

  template <class Label> void levels(const char* name, Label label) {
    std::set<std::string> words;
    for (std::size_t i = 0; i < design_.size(); ++i) {
      if (design_.shows_board(i)) words.insert(label(design_.conditions()[i]));
    }
    if (words.size() < 2) return;
    Axis axis{name, {}};
    for (auto word = std::next(words.begin()); word != words.end(); ++word)
      axis.columns.push_back([this, label, word = *word](std::size_t i, std::size_t) {
        return label(design_.conditions()[i]) == word ? 1.0 : 0.0;
      });
    axes_.push_back(std::move(axis));
  }

  /// Adds a number of periods per turn of the phase.
  void cycle(int cycles) {
    const double range = physics::unambiguous_range(design_.camera().modulation_frequency);
    Axis axis{fmt::format("period {:.2f} m", range / cycles), {}};
    for (const double quarter : {0.0, std::numbers::pi / 2}) {
      axis.columns.push_back([this, cycles, quarter](std::size_t i, std::size_t s) {
        return std::cos(cycles * std::arg(design_.ideal(i)[s].phasor) - quarter);
      });
    }
    axes_.push_back(std::move(axis));
  }

  const Design& design_;
  std::vector<Axis> axes_;
};

/// Root mean square over the known superpixels, SI, of a pattern whose columns have these values: of all, and of the
/// condition where it is largest.
std::pair<double, double> size_of(const Pattern& basis, const Group& group, const Eigen::VectorXd& values,
                                  const Problem& problem) {
  const std::size_t first = basis.observable * problem.design.superpixels();
  double sum = 0, count = 0, largest = 0;
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    double here = 0, known = 0;
    for (const std::size_t row : problem.known_rows(i, basis.observable)) {
      double value = 0;
      for (std::size_t c = 0; c < group.columns.size(); ++c)
        value += values(static_cast<Eigen::Index>(c)) * group.columns[c][i][row - first];
      here += value * value;
      ++known;
    }
    if (known > 0) largest = std::max(largest, std::sqrt(here / known));
    sum += here;
    count += known;
  }
  return {count > 0 ? std::sqrt(sum / count) : 0, largest};
}

/// Pattern of distances that scatter from one condition to the next. @param sd m
Pattern scatter_pattern(const char* axis, double gain, double sd) {
  return {.observable = distance,
          .axis = axis,
          .gain = gain,
          .p_value = std::erfc(std::sqrt(std::max(gain, 0.0) / 2)),
          .size = sd,
          .significant = true,
          .largest = sd,
          .share = std::numeric_limits<double>::quiet_NaN()};
}

}  // namespace

Bases generic_bases(const Problem& problem) {
  const Design& design = problem.design;
  const std::size_t n = design.superpixels();
  Bases bases;
  Axes axes(design);  // must outlive the covariates, which refer to it
  for (const Axis& axis : axes.all()) {
    std::vector<Column> values;
    for (const Covariate& covariate : axis.columns) {
      auto& column = values.emplace_back(design.size(), std::vector<double>(n));
      for (std::size_t i = 0; i < design.size(); ++i) {
        if (!design.shows_board(i) && axis.name != lens_axis) continue;  // a capped lens has no such setting
        for (std::size_t s = 0; s < n; ++s) {
          const double value = covariate(i, s);
          column[i][s] = std::isfinite(value) ? basis_unit * value : 0;
        }
      }
    }
    for (std::size_t o = 0; o < observables; ++o) {
      if (!are_seen(o, design, problem.data)) continue;
      bases.patterns.push_back({o, axis.name});
      bases.groups.push_back({values, o * n});
    }
  }
  return bases;
}

std::string name_of(const Pattern& pattern) {
  const bool along = pattern.axis != everywhere && !pattern.axis.starts_with("period") && pattern.axis != no_setting &&
                     pattern.axis != smooth_over_image;
  return fmt::format("{}{} {}", observable_names[pattern.observable], along ? " along" : ",", pattern.axis);
}

std::optional<Pattern> unsteady_camera(const Problem& problem, const ModelFit& fit) {
  const RandomEffectSd& sd = fit.state.random_sd;
  if (sd.offset < settings.unsteady_sd) return std::nullopt;
  State merged = fit.state;
  merged.random_sd.jitter = std::hypot(sd.jitter, sd.offset);
  merged.random_sd.offset = 0;
  const double gain = fit_nuisances(problem, merged).deviance - fit.deviance;
  if (gain < settings.unsteady_min_gain) return std::nullopt;
  return scatter_pattern(no_setting, gain, sd.offset);
}

std::optional<Pattern> large_smooth_field(const Problem& problem, const ModelFit& fit) {
  const SmoothField* const field = fit.state.nuisances.smooth_field.get();
  if (field == nullptr || field->sd() < settings.field_max_nuisance_sd) return std::nullopt;
  State without = fit.state;
  without.nuisances.smooth_field = nullptr;
  double gain = deviance_of(problem, without) - deviance_of(problem, fit.state);
  for (std::size_t i = 0; i < problem.data.size(); ++i) gain -= field->log_determinant(i);
  return scatter_pattern(smooth_over_image, gain, field->sd());
}

PatternFinder::PatternFinder(const Problem& problem) : problem_(problem), bases_(generic_bases(problem)) {
  for (const Group& group : bases_.groups) groups_.push_back(&group);
}

PatternScan PatternFinder::find(const ModelFit& fit, std::optional<std::uint64_t> seed) const {
  const Scan scanned = scan(problem_, fit, groups_, seed);
  PatternScan result{{}, {}, 0, scanned.square, scanned.freedom};
  std::vector<double> p_values;
  for (const Score& score : scanned.scores) {
    p_values.push_back(score.own_p_value);
    result.gains.push_back(score.gain - score.dimension);
    result.most = std::max(result.most, result.gains.back());
  }
  if (!seed) return result;
  const double limit = false_discovery_limit(p_values, settings.false_discoveries);
  const double beyond = scanned.square - scanned.freedom;
  for (std::size_t b = 0; b < bases_.patterns.size(); ++b) {
    const Score& score = scanned.scores[b];
    // A single pattern among many without effect cannot reach the false discovery limit with this number of draws.
    const bool beyond_chance = score.own_p_value <= limit || significant(score);
    if (!beyond_chance || score.gain < settings.min_pattern_gain) continue;
    const auto [size, largest] = size_of(bases_.patterns[b], bases_.groups[b], score.values, problem_);
    result.patterns.push_back({bases_.patterns[b].observable, bases_.patterns[b].axis, score.gain, score.own_p_value,
                               size, significant(score), largest,
                               std::clamp(score.gain / std::max(beyond, score.gain), 0.0, 1.0)});
  }
  std::ranges::stable_sort(result.patterns, [](const Pattern& a, const Pattern& b) {
    return std::pair(a.p_value, -a.gain) < std::pair(b.p_value, -b.gain);
  });
  return result;
}

}  // namespace tofgraph::diagnosis
