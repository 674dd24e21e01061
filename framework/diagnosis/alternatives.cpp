// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/alternatives.hpp"

#include "diagnosis/probes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

constexpr int most_refinements = 2;  ///< of an effect at once

/// Values of a shape that is no angle. @param many where it is the only one of an effect
std::vector<double> range(const FreeParameter& shape, bool many) {
  static constexpr double all[] = {0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5, 5}, few[] = {0.3, 1, 3};
  std::vector<double> values;
  for (const double factor : many ? std::span<const double>(all) : std::span<const double>(few)) {
    const double value = std::clamp(factor * shape.typical, shape.minimum, shape.maximum);
    if (std::ranges::find(values, value) == values.end()) values.push_back(value);
  }
  return values;
}

/// Shapes of some parameters, all combinations; sizes are off, angles zero or as near as their bounds allow.
std::vector<std::vector<double>> shapes_of(std::span<const FreeParameter> parameters) {
  constexpr std::ptrdiff_t most_varied = 2;
  const auto varied = [](const FreeParameter& p) { return p.shape && !p.is_angle(); };
  const auto count = std::ranges::count_if(parameters, varied);
  std::vector<std::vector<double>> all(1);
  for (const FreeParameter& p : parameters) {
    std::vector<double> values = {varied(p) ? p.typical : p.shape ? std::clamp(0.0, p.minimum, p.maximum) : p.off};
    if (varied(p) && count <= most_varied) values = range(p, count == 1);
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : all) {
      for (const double value : values) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    }
    all = std::move(longer);
  }
  return all;
}

/// The columns of some parameters of an effect, at one combination of their shapes.
struct Block {
  std::vector<double> values;
  std::vector<Alternative::Part> parts;  ///< counted among the block's parameters
  std::vector<Eigen::Index> columns;
};

class Builder {
 public:
  Builder(const Problem& problem, const State& state) : problem_(problem), state_(state) {}

  void add(const Candidate& candidate, std::size_t effect) {
    const std::size_t before = result_.group.columns.size();
    try {
      const auto alone = [&](const std::vector<double>& values) { return Term{&candidate, values}; };
      std::vector<Block> roots;
      for (const std::vector<double>& values : shapes_of(candidate.free()))
        roots.push_back(block(candidate.free(), values, alone));
      std::vector<Block> refinements;
      for (std::size_t r = 0; r < candidate.refinements().size(); ++r) refinements.push_back(refinement(candidate, r));
      for (const Block& root : roots) combine(candidate, effect, root, refinements);
    } catch (const simulation::EffectError&) {
      result_.group.columns.resize(before);
      throw;
    }
  }

  Alternatives take() { return std::move(result_); }

 private:
  Column rows_with(const Term& term) const {
    State with = state_;
    with.terms.push_back(term);
    return expected(problem_, with);
  }

  /// @param place makes the term that has some values of the parameters
  template <class Place>
  Block block(std::span<const FreeParameter> parameters, const std::vector<double>& values, const Place& place) {
    Block result{values, {}, {}};
    const Column without = rows_with(place(values));
    const auto angle = std::ranges::find_if(parameters, &FreeParameter::is_angle);
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].shape) continue;
      Alternative::Part part{k, std::nullopt, parameters[k].step()};
      if (angle != parameters.end()) part.angle = static_cast<std::size_t>(angle - parameters.begin());
      std::vector<double> moved = values;
      moved[k] += part.step;
      add_column(result, difference(rows_with(place(moved)), without));
      if (part.angle) {
        moved[*part.angle] += std::numbers::pi / 2;
        add_column(result, difference(rows_with(place(moved)), without));
      }
      result.parts.push_back(part);
    }
    return result;
  }

  void add_column(Block& block, Column column) {
    block.columns.push_back(static_cast<Eigen::Index>(result_.group.columns.size()));
    result_.group.columns.push_back(std::move(column));
  }

  /// Where the effect is as usual: a refinement of one that is off may change nothing.
  Block refinement(const Candidate& candidate, std::size_t r) {
    std::vector<double> usual;
    for (const FreeParameter& p : candidate.free()) usual.push_back(p.shape ? p.typical : p.off + p.step());
    const Term term{&candidate, std::move(usual)};
    const std::vector<FreeParameter>& parameters = candidate.refinements()[r].parameters;
    std::vector<double> values;
    for (const FreeParameter& p : parameters)
      values.push_back(p.is_angle() ? std::clamp(0.0, p.minimum, p.maximum) : p.shape ? p.typical : p.off);
    return block(parameters, values, [&](const std::vector<double>& chosen) { return refined(term, r, chosen); });
  }

  void combine(const Candidate& candidate, std::size_t effect, const Block& root,
               const std::vector<Block>& refinements) {
    for (std::size_t bits = 0; bits < std::size_t{1} << refinements.size(); ++bits) {
      if (std::popcount(bits) > most_refinements) continue;
      Alternative one{&candidate, root.values, root.parts};
      Choice choice{effect, root.columns, 0};
      for (std::size_t r = 0; r < refinements.size(); ++r) {
        if ((bits >> r & 1U) == 0) continue;
        const std::size_t at = one.candidate->place(r);
        one.candidate = &one.candidate->with(r);
        one.values.insert(one.values.end(), refinements[r].values.begin(), refinements[r].values.end());
        for (Alternative::Part part : refinements[r].parts) {
          part.size += at;
          if (part.angle) *part.angle += at;
          one.parts.push_back(part);
        }
        std::ranges::copy(refinements[r].columns, std::back_inserter(choice.columns));
      }
      choice.dimension = static_cast<double>(one.candidate->free().size());
      result_.list.push_back(std::move(one));
      result_.choices.push_back(std::move(choice));
    }
  }

  const Problem& problem_;
  const State& state_;
  Alternatives result_;
};

}  // namespace

Term Alternative::term(std::span<const double> columns) const {
  Term term{candidate, values};
  std::size_t c = 0;
  for (const Part& part : parts) {
    const std::vector<FreeParameter>& free = candidate->free();
    double length = columns[c++];
    if (part.angle) {
      const double quarter = columns[c++];
      double& angle = term.values[*part.angle];
      angle += std::atan2(quarter, length);
      const FreeParameter& p = free[*part.angle];
      const double turn = 2 * std::numbers::pi;
      angle = std::clamp(angle - turn * std::floor((angle - p.minimum) / turn), p.minimum, p.maximum);
      length = std::hypot(length, quarter);
    }
    const FreeParameter& size = free[part.size];
    term.values[part.size] = std::clamp(size.off + length * part.step, size.minimum, size.maximum);
  }
  return term;
}

Alternatives alternatives_of(const Problem& problem, const State& state,
                             const std::vector<std::unique_ptr<Candidate>>& candidates,
                             std::map<std::string, std::string>& refused) {
  Builder builder(problem, state);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Candidate& candidate = *candidates[c];
    if (candidate.sizes() == 0 || !candidate.maps().empty() || is_in(state, candidate) ||
        refused.contains(candidate.name()))
      continue;
    try {
      builder.add(candidate, c);
    } catch (const simulation::EffectError& error) {
      refused.emplace(candidate.name(), error.what());
    }
  }
  return builder.take();
}

}  // namespace tofgraph::diagnosis
