// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/alternatives.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

/// Values of a nonlinear parameter that is not an angle. @param many more values, if it is the only one of an effect
std::vector<double> range(const FreeParameter& nonlinear, bool many) {
  static constexpr double all[] = {0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5, 5}, few[] = {0.3, 1, 3};
  return nonlinear.multiples(many ? std::span<const double>(all) : std::span<const double>(few));
}

/// All combinations of nonlinear values of some parameters; amplitudes off, angles zero or as near as bounds allow.
std::vector<std::vector<double>> shapes_of(std::span<const FreeParameter> parameters) {
  const auto varied = [](const FreeParameter& p) { return p.nonlinear && !p.is_angle(); };
  const auto count = std::ranges::count_if(parameters, varied);
  std::vector<std::vector<double>> values;
  for (const FreeParameter& p : parameters) {
    if (varied(p) && count <= settings.max_varied)
      values.push_back(range(p, count == 1));
    else
      values.push_back({varied(p) ? p.typical : p.nonlinear ? std::clamp(0.0, p.minimum, p.maximum) : p.off});
  }
  return combinations(values);
}

/// Columns of some parameters of an effect, at one combination of their nonlinear values.
struct Block {
  std::vector<double> values;
  std::vector<Alternative::Amplitude> parts;  ///< indices among the block's parameters
  std::vector<Eigen::Index> columns;
};

/// Sum of the products of two columns over the known values, each divided by its variance.
/// @param with_intensity false: without the intensities
double product_of(const Problem& problem, const Column& a, const Column& b, bool with_intensity = true) {
  const std::size_t n = problem.design.superpixels();
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::vector<double>& variance = problem.data[i].variance;
    for (std::size_t row = 0; row < a[i].size(); ++row) {
      if (std::isfinite(variance[row]) && (with_intensity || row / n != intensity))
        sum += a[i][row] * b[i][row] / variance[row];
    }
  }
  return sum;
}

/// True if a candidate is one of some forms, or contains one.
bool is_one_of(std::span<const Candidate* const> forms, const Candidate& candidate) {
  return std::ranges::any_of(forms, [&](const Candidate* form) { return candidate.contains_form(*form); });
}

class Builder {
 public:
  Builder(const Problem& problem, const State& state)
      : problem_(problem), state_(state), rows_(expected(problem, state)) {}

  void add(const Candidate& candidate, std::size_t effect) {
    const std::size_t before = result_.group.columns.size();
    try {
      const auto alone = [&](const std::vector<double>& values) { return with({&candidate, values}); };
      std::vector<Block> roots;
      for (const std::vector<double>& values : shapes_of(candidate.free()))
        roots.push_back(block(candidate.free(), values, alone, rows_));  // an effect that is off changes nothing
      std::vector<Block> refinements;
      for (std::size_t r = 0; r < candidate.refinements().size(); ++r) refinements.push_back(refinement(candidate, r));
      for (const Block& root : roots) combine(candidate, effect, root, refinements);
    } catch (const simulation::EffectError&) {
      result_.group.columns.resize(before);
      throw;
    }
  }

  /// Adds refinements that a term of the state lacks. Those that fail are left out. @param but forms to leave out
  void add_refinements_of(std::size_t t, std::size_t& effect, std::span<const Candidate* const> but) {
    const Candidate& candidate = *state_.terms[t].candidate;
    for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
      if (candidate.refined(r) || is_one_of(but, candidate.with(r))) continue;
      const std::vector<FreeParameter>& parameters = candidate.refinements()[r].parameters;
      const std::size_t before = result_.group.columns.size();
      try {
        for (const std::vector<double>& values : shapes_of(parameters)) {
          const auto there = [&](const std::vector<double>& chosen) {
            State with = state_;
            with.terms[t] = refined(with.terms[t], r, chosen);
            return with;
          };
          Block one = block(parameters, values, there, rows_);
          result_.choices.push_back({effect, one.columns, static_cast<double>(parameters.size())});
          result_.list.push_back({&candidate.with(r), ModelTerm{t, r}, std::move(one.values), std::move(one.parts)});
        }
      } catch (const simulation::EffectError&) {
        result_.group.columns.resize(before);
        std::erase_if(result_.choices, [&](const Choice& choice) { return choice.effect == effect; });
        result_.list.resize(result_.choices.size());
      }
      ++effect;
    }
  }

  /// Lists effects whose first amplitude, at all nonlinear values, makes the same change as an effect without such
  /// values, and whose further amplitudes do not depend on them: a warm-up of a camera that was always warm is a
  /// constant, a reflection in the camera at one frequency is a crosstalk.
  void find_repeated(const Candidates& candidates) {
    std::vector<std::vector<std::size_t>> forms(candidates.size());  // of each effect, without refinements
    for (std::size_t c = 0; c < result_.list.size(); ++c) {
      const Candidate& candidate = *result_.list[c].candidate;
      if (&candidate == &candidate.root()) forms[result_.choices[c].effect].push_back(c);
    }
    for (std::size_t e = 0; e < forms.size(); ++e) {
      const auto repeats = [&](const std::vector<std::size_t>& simpler) {
        return simpler.size() == 1 && std::ranges::all_of(forms[e], [&](std::size_t form) {
                 return can_imitate(simpler.front(), column_of(form, 0)) &&
                        further_columns_are_the_same(forms[e].front(), form);
               });
      };
      if (forms[e].size() > 1 && std::ranges::any_of(forms, repeats)) result_.repeated.push_back(candidates[e].get());
    }
  }

  Alternatives result() { return std::move(result_); }

 private:
  const Column& column_of(std::size_t alternative, std::size_t k) const {
    return result_.group.columns[static_cast<std::size_t>(result_.choices[alternative].columns[k])];
  }

  bool are_collinear(const Column& a, const Column& b) const {
    return std::pow(product_of(problem_, a, b), 2) >
           settings.collinear * settings.collinear * product_of(problem_, a, a) * product_of(problem_, b, b);
  }

  bool further_columns_are_the_same(std::size_t one, std::size_t other) const {
    for (std::size_t k = 1; k < result_.choices[one].columns.size(); ++k)
      if (!are_collinear(column_of(one, k), column_of(other, k))) return false;
    return true;
  }

  /// True if an alternative, with suitable amplitudes, makes the same change as a column. They are determined without
  /// the intensities, which grow by the size of a complex amplitude: that is not linear in its parts.
  bool can_imitate(std::size_t alternative, const Column& change) const {
    constexpr int rounds = 5;  // the changes are not small everywhere
    const std::size_t count = result_.choices[alternative].columns.size();
    const auto n = static_cast<Eigen::Index>(count);
    Eigen::MatrixXd information(n, n);
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < count; ++b)
        information(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
            product_of(problem_, column_of(alternative, a), column_of(alternative, b), false);
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver(information);
    Eigen::VectorXd amplitudes = Eigen::VectorXd::Zero(n), score(n);
    Column rest = change;
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t a = 0; a < count; ++a)
        score(static_cast<Eigen::Index>(a)) = product_of(problem_, column_of(alternative, a), rest, false);
      const Eigen::VectorXd more = solver.solve(score);
      const double explained = score.dot(more);
      if (round == 0 && !(explained > std::pow(settings.alike_above, 2) * product_of(problem_, rest, rest, false)))
        return false;
      amplitudes += more;
      try {
        const State there = result_.list[alternative].placed(state_, {amplitudes.data(), count});
        rest = difference(change, difference(expected(problem_, there), rows_));
      } catch (const simulation::EffectError&) {  // fails with these amplitudes
        return false;
      }
    }
    // Few conditions may show that a complex amplitude changes more: a capped lens. At typical size they must not.
    const double limit = count > 1 ? std::pow(settings.blind_below, 2)
                                   : (1 - std::pow(settings.collinear, 2)) * product_of(problem_, change, change);
    return product_of(problem_, rest, rest) < limit;
  }

  State with(Term term) const {
    State more = state_;
    more.terms.push_back(std::move(term));
    return more;
  }

  /// @param place makes the state with given values of the parameters @param without rows of it with the amplitudes off
  template <class Place> Block block(std::span<const FreeParameter> parameters, const std::vector<double>& values,
                                     const Place& place, const Column& without) {
    Block result{values, {}, {}};
    const auto angle = std::ranges::find_if(parameters, &FreeParameter::is_angle);
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].nonlinear) continue;
      Alternative::Amplitude part{k, std::nullopt, parameters[k].step()};
      if (angle != parameters.end()) part.angle = static_cast<std::size_t>(angle - parameters.begin());
      std::vector<double> moved = values;
      moved[k] += part.step;
      add_column(result, difference(expected(problem_, place(moved)), without));
      if (part.angle) {
        moved[*part.angle] += std::numbers::pi / 2;
        add_column(result, difference(expected(problem_, place(moved)), without));
      }
      result.parts.push_back(part);
    }
    return result;
  }

  void add_column(Block& block, Column column) {
    block.columns.push_back(static_cast<Eigen::Index>(result_.group.columns.size()));
    result_.group.columns.push_back(std::move(column));
  }

  /// At usual values of the effect, because a refinement of an effect that is off may change nothing.
  Block refinement(const Candidate& candidate, std::size_t r) {
    std::vector<double> usual;
    for (const FreeParameter& p : candidate.free()) usual.push_back(p.nonlinear ? p.typical : p.off + p.step());
    const Term term{&candidate, std::move(usual)};
    const std::vector<FreeParameter>& parameters = candidate.refinements()[r].parameters;
    std::vector<double> values;
    for (const FreeParameter& p : parameters)
      values.push_back(p.is_angle() ? std::clamp(0.0, p.minimum, p.maximum) : p.nonlinear ? p.typical : p.off);
    const auto there = [&](const std::vector<double>& chosen) { return with(refined(term, r, chosen)); };
    return block(parameters, values, there, expected(problem_, there(values)));
  }

  void combine(const Candidate& candidate, std::size_t effect, const Block& root,
               const std::vector<Block>& refinements) {
    for (std::size_t bits = 0; bits < std::size_t{1} << refinements.size(); ++bits) {
      if (std::popcount(bits) > settings.max_refinements_at_once) continue;
      Alternative one{&candidate, std::nullopt, root.values, root.parts};
      Choice choice{effect, root.columns, 0};
      for (std::size_t r = 0; r < refinements.size(); ++r) {
        if ((bits >> r & 1U) == 0) continue;
        const std::size_t at = one.candidate->first_parameter_of(r);
        one.candidate = &one.candidate->with(r);
        one.values.insert(one.values.end(), refinements[r].values.begin(), refinements[r].values.end());
        for (Alternative::Amplitude part : refinements[r].parts) {
          part.amplitude += at;
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
  const Column rows_;
  Alternatives result_;
};

}  // namespace

std::string Alternative::name() const {
  if (refines) return candidate->name() + "." + candidate->refinements()[*refines->refinement].name;
  std::string text = candidate->name();
  for (std::size_t r = 0; r < candidate->refinements().size(); ++r) {
    if (candidate->refined(r))
      text += (text.find(' ') == std::string::npos ? " with " : " and ") + candidate->refinements()[r].name;
  }
  return text;
}

State Alternative::placed(State state, std::span<const double> columns) const {
  std::vector<double> chosen = values;
  std::size_t c = 0;
  for (const Amplitude& part : parts) {
    double length = columns[c++];
    if (part.angle) {
      const double quarter = columns[c++], turn = 2 * std::numbers::pi;
      const FreeParameter& p = parameters()[*part.angle];
      const double angle = chosen[*part.angle] + std::atan2(quarter, length);
      chosen[*part.angle] = std::clamp(angle - turn * std::floor((angle - p.minimum) / turn), p.minimum, p.maximum);
      length = std::hypot(length, quarter);
    }
    const FreeParameter& size = parameters()[part.amplitude];
    chosen[part.amplitude] = std::clamp(size.off + length * part.step, size.minimum, size.maximum);
  }
  if (refines)
    state.terms[refines->term] = refined(state.terms[refines->term], *refines->refinement, chosen);
  else
    state.terms.push_back({candidate, std::move(chosen)});
  return state;
}

Alternatives alternatives_of(const Problem& problem, const State& state, const Candidates& candidates,
                             std::map<std::string, std::string>& refused) {
  Builder builder(problem, state);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Candidate& candidate = *candidates[c];
    if (candidate.amplitudes() == 0 || !candidate.maps().empty() || is_in(state, candidate) ||
        refused.contains(candidate.name()))
      continue;
    if (candidate.amplitudes() > settings.max_amplitudes) {
      refused.emplace(candidate.name(), fmt::format("has {} sizes, of which {} can be searched at most",
                                                    candidate.amplitudes(), settings.max_amplitudes));
      continue;
    }
    try {
      builder.add(candidate, c);
    } catch (const simulation::EffectError& error) {
      refused.emplace(candidate.name(), error.what());
    }
  }
  builder.find_repeated(candidates);
  return builder.result();
}

Alternatives alternatives_missing_in(const Problem& problem, const State& state, const Alternatives& some,
                                     std::span<const Candidate* const> but) {
  Builder builder(problem, state);
  std::size_t effect = 0;
  for (const Choice& choice : some.choices) effect = std::max(effect, choice.effect + 1);
  for (std::size_t t = 0; t < state.terms.size(); ++t) builder.add_refinements_of(t, effect, but);
  Alternatives result = builder.result();
  const auto own = static_cast<Eigen::Index>(result.group.columns.size());
  std::map<Eigen::Index, Eigen::Index> moved;  // old to new columns, some of which alternatives share
  for (std::size_t a = 0; a < some.list.size(); ++a) {
    const Candidate& candidate = *some.list[a].candidate;
    if (is_in(state, candidate) || is_one_of(but, candidate)) continue;
    Choice choice = some.choices[a];
    for (Eigen::Index& column : choice.columns) {
      const auto [at, first] = moved.try_emplace(column, own + static_cast<Eigen::Index>(result.group.borrowed.size()));
      if (first) result.group.borrowed.push_back(&some.group.columns[static_cast<std::size_t>(column)]);
      column = at->second;
    }
    result.choices.push_back(std::move(choice));
    result.list.push_back(some.list[a]);
  }
  return result;
}

}  // namespace tofgraph::diagnosis
