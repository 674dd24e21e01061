// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Next.TheCondition*:Next.WhatThe*
// Rooms: diagnosis
// Suggested next conditions, compared with brute force: each listed condition with an explicit covariance.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/next_condition.hpp"
#include "tests/unit/rail.hpp"

#include <fmt/ranges.h>

#include <cmath>
#include <numbers>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double constant = 4, slope = 0.02;  // counts^2 and counts^2 per count, of a superpixel's sample

class Next : public Rail {
 protected:
  void SetUp() override {
    Rail::SetUp();
    // Same RandomEffectSd for all conditions, so that those of new conditions are known here without calling the code.
    for (std::size_t i = 0; i < design->size(); ++i) {
      for (std::size_t s = 0; s < design->superpixels(); ++s) {
        const Signal& signal = design->ideal(i)[s];
        for (std::size_t o = 0; o < observables; ++o)
          blank[i].variance[o * design->superpixels() + s] = law(signal, o, std::exp(light));
      }
    }
  }

  static double law(const Signal& signal, std::size_t o, double factor) {
    const double level = factor * (o == intensity || o == null1 ? signal.intensity : std::abs(signal.phasor));
    return (constant + slope * factor * signal.intensity) / (level * level);
  }

  State state_with(const std::vector<Term>& terms) const {
    return {terms, std::vector<double>(2, light), {.jitter = 4e-4, .offset = 1e-4, .light = 3e-3}};
  }

  /// d' C^-1 d of a single condition: C is built up direction by direction (Sherman-Morrison). @param open further
  /// directions of C
  double brute_force(const io::Condition& condition, const State& one, const State& other,
                     const std::vector<Eigen::VectorXd>& open = {}) const {
    const Design alone(design->camera_pointer(), design->physical(), {condition});
    const auto model = [&](const State& state) { return forward_model(state.terms, alone.camera(), true); };
    const std::vector<double> first = alone.predict(model(one), 0, one.log_reflectivity[0]),
                              second = alone.predict(model(other), 0, other.log_reflectivity[0]);
    const std::size_t rows = alone.rows(), n = alone.superpixels();
    std::vector<Eigen::VectorXd> directions(3, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows)));
    Eigen::VectorXd change(rows), inverse(rows);
    constexpr double step = 0.01;
    const std::vector<double> lit = alone.predict(model(one), 0, one.log_reflectivity[0] + step);
    for (std::size_t row = 0; row < rows; ++row) {
      const auto r = static_cast<Eigen::Index>(row);
      const Signal& signal = alone.ideal(0)[row % n];
      const double relative = law(signal, amplitude, std::exp(light));
      const bool full =
          std::exp(light) * (signal.intensity + std::abs(signal.phasor) / 2) > 0.98 * alone.camera().full_well;
      change(r) = second[row] - first[row];
      inverse(r) = relative * 100 < 1 && !full ? 1 / law(signal, row / n, std::exp(light)) : 0;
      directions[0](r) = one.random_sd.jitter * alone.shift(0)[row];
      directions[1](r) = one.random_sd.offset * alone.offset(0)[row];
      directions[2](r) = one.random_sd.light * (lit[row] - first[row]) / step;
    }
    std::ranges::copy(open, std::back_inserter(directions));
    Eigen::MatrixXd u(rows, 0);  // C^-1 = D^-1 - sum of u u'
    const auto solved = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
      return inverse.cwiseProduct(v) - u * (u.transpose() * v);
    };
    for (const Eigen::VectorXd& direction : directions) {
      const Eigen::VectorXd w = solved(direction);
      u.conservativeResize(Eigen::NoChange, u.cols() + 1);
      u.rightCols(1) = w / std::sqrt(1 + direction.dot(w));
    }
    const Eigen::VectorXd weighted = solved(change);
    const double square = change.dot(weighted);
    for (const Eigen::VectorXd& direction : open) change -= direction * direction.dot(weighted);
    // Below the practical threshold, only the part due to board, camera and light counts, in units of their sd.
    Eigen::MatrixXd along(rows, 3);
    const State& sd = one;
    along << directions[0] / sd.random_sd.jitter, directions[1] / sd.random_sd.offset,
        directions[2] / sd.random_sd.light;
    const Eigen::VectorXd root = inverse.cwiseSqrt();
    const Eigen::VectorXd taken =
        (root.asDiagonal() * along).completeOrthogonalDecomposition().solve(root.cwiseProduct(change));
    const Eigen::VectorXd rest = change - along * taken;
    for (std::size_t o = 0; o < observables; ++o) {
      double sum = 0, count = 0;
      for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
        const auto r = static_cast<Eigen::Index>(row);
        if (inverse(r) > 0) sum += rest(r) * rest(r), ++count;
      }
      if (count > 0 && std::sqrt(sum / count) >= settings.practical_threshold[o]) return std::sqrt(square);
    }
    return std::sqrt(std::min(square, std::pow(taken(0) + taken(1), 2) /
                                              (std::pow(sd.random_sd.jitter, 2) + std::pow(sd.random_sd.offset, 2)) +
                                          std::pow(taken(2) / sd.random_sd.light, 2)));
  }

  static constexpr double light = 0.2;
};

TEST_F(Next, TheListHasWhatTheCampaignHasAndMore) {
  const Problem problem = make_problem(*design, blank);
  const std::vector<io::Condition> list = candidate_conditions(problem, std::vector<double>(2, light));
  std::set<double> distances, times, since;
  std::set<std::string> targets, others;
  std::set<std::pair<double, double>> tilts;
  std::set<double> capped;  // times, s
  std::size_t changed = 0;
  for (const io::Condition& c : list) {
    if (c.is_capped()) {
      capped.insert(c.integration_time);
      continue;
    }
    distances.insert(c.board_distance);
    times.insert(c.integration_time);
    since.insert(c.time_since_power_on);
    targets.insert(c.target);
    tilts.emplace(std::round(c.board_tilt_x * 180 / std::numbers::pi),
                  std::round(c.board_tilt_y * 180 / std::numbers::pi));
    std::vector<std::string> other = c.sources;
    if (c.time_since_power_on != 3600) other.push_back(fmt::format("{} s", c.time_since_power_on));
    if (c.ambient != "dark") other.push_back(c.ambient);
    if (!c.rail.empty()) other.push_back(c.rail);
    if (!c.reference.empty()) other.push_back(c.reference);
    if (c.roll != 0) other.push_back(fmt::format("{:.0f} deg", c.roll * 180 / std::numbers::pi));
    if (other.empty()) continue;
    EXPECT_EQ(other.size(), 1U) << "one thing at a time";
    EXPECT_TRUE(c.board_tilt_x == 0 && c.board_tilt_y == 0);
    EXPECT_TRUE(c.integration_time == 1e-3 || c.integration_time == 4e-3);
    others.insert(other.front());
    ++changed;
  }
  EXPECT_LT(*distances.begin(), 0.6);
  EXPECT_GT(*distances.rbegin(), 0.6 + 9 * 0.43);
  EXPECT_EQ(times, (std::set<double>{5e-4, 1e-3, 4e-3, 8e-3}));
  EXPECT_EQ(since, (std::set<double>{60, 3600, 7200}));
  EXPECT_EQ(targets, (std::set<std::string>{"grey", "white"}));
  EXPECT_EQ(tilts, (std::set<std::pair<double, double>>{{0, 0}, {20, 0}, {-20, 0}, {0, 20}, {0, -20}}));
  EXPECT_EQ(others, (std::set<std::string>{"60 s", "7200 s", "left", "right", "lamp", "covered", "laser", "90 deg"}));
  std::set<double> longer = times;
  longer.insert(50e-3);
  EXPECT_EQ(capped, longer) << "nothing fills the well: as long as the camera can";
  EXPECT_EQ(changed, distances.size() * 2 * targets.size() * others.size());
  EXPECT_EQ(list.size() - changed, capped.size() + distances.size() * times.size() * targets.size() * tilts.size());
}

/// Rail to 6.4 m: 1.3 times that is beyond the 7.49 m of 20 MHz, and so is a corner of a tilted board at 6.4 m.
TEST_F(Next, NoConditionIsBeyondWhatTheCameraCanDo) {
  for (io::Condition& c : conditions) {
    c.board_distance *= 6.4 / (0.6 + 9 * 0.43);
    c.integration_time = c.integration_time < 2e-3 ? 0.6e-3 : 40e-3;
  }
  measure();
  const Problem problem = make_problem(*design, blank);
  std::set<double> times;
  double facing = 0, tilted = 0;
  for (const io::Condition& c : candidate_conditions(problem, std::vector<double>(2, light))) {
    times.insert(c.integration_time);
    double& farthest = c.board_tilt_x == 0 && c.board_tilt_y == 0 ? facing : tilted;
    farthest = std::max(farthest, c.board_distance);
  }
  EXPECT_EQ(times, (std::set<double>{0.5e-3, 0.6e-3, 40e-3, 50e-3})) << "the profile has 0.5 to 50 ms";
  EXPECT_NEAR(facing, 6.4, 1e-9);
  EXPECT_LT(tilted, 6.2) << "its corner is 1.24 times as far";
}

/// Data beyond the unambiguous range determine the boards' period: the list extends that far, and no farther.
TEST_F(Next, ACampaignBeyondTheUnambiguousRangeGoesNoFarther) {
  for (io::Condition& c : conditions) c.board_distance += 8;
  measure();
  std::set<double> distances;
  for (const io::Condition& c : candidate_conditions(make_problem(*design, blank), std::vector<double>(2, light))) {
    if (!c.is_capped()) distances.insert(c.board_distance);
  }
  EXPECT_GT(distances.size(), 4U);
  EXPECT_NEAR(*distances.rbegin(), 8.6 + 9 * 0.43, 1e-9);
}

TEST_F(Next, TheConditionOfATieIsTheBestOfAll) {
  const Problem problem = make_problem(*design, blank);
  const State one = state_with({{&effect("rail_scale"), {2e-3}}}),
              other = state_with({{&effect("modulation_frequency"), {-2e-3}}});
  const std::vector<Question> questions = {{{"rail_scale", "modulation_frequency"}, one, other, "a laser"}};
  const std::vector<NextCondition> next = next_conditions(problem, questions);
  ASSERT_EQ(next.size(), 1U);
  double best = 0;
  for (const io::Condition& c : candidate_conditions(problem, one.log_reflectivity)) {
    if (!c.is_capped()) best = std::max(best, brute_force(c, one, other));
  }
  EXPECT_NEAR(next[0].sigma, best, 1e-3 * best);
  EXPECT_NEAR(brute_force(next[0].condition, one, other), best, 1e-3 * best);
  // Measured conditions are treated likewise.
  double measured = 0;
  for (const io::Condition& c : conditions) measured = std::max(measured, brute_force(c, one, other));
  EXPECT_NEAR(next[0].measured_sigma, measured, 1e-3 * measured);
  EXPECT_GT(next[0].sigma, next[0].measured_sigma) << "the list has more to offer than what is there";
}

/// Two amplitudes whose sum one integration time determines: at another time they can compensate a zero offset.
TEST_F(Next, WhatTheCampaignLeavesOpenTellsNothingElsewhere) {
  for (io::Condition& c : conditions) c.integration_time = 5e-3;
  measure();
  const Problem problem = make_problem(*design, blank);
  const State zero = state_with({{&effect("zero_offset"), {8e-3}}}),
              other = state_with({{&effect("integration_time_offset"), {8e-3 / std::log(5.0), 0}}});
  EffectFinding found;
  found.candidate = &effect("zero_offset"), found.name = "zero_offset";
  found.rivals = {{&effect("integration_time_offset"), {found.name}, 0, 0, true, other}};
  Question question = open_questions(problem, zero, {found}, {}, {}).at(0);
  const NextCondition open = next_conditions(problem, {question}).at(0);
  EXPECT_LT(open.sigma, 1);
  question.information_of_other = {};
  EXPECT_GT(next_conditions(problem, {question}).at(0).sigma, 5) << "with its values as they are";
}

/// d' (C + J P J')^-1 d, with P the covariance of the values and the reflectivities, computed explicitly.
TEST_F(Next, OpenValuesAreAPartOfTheCovariance) {
  const Problem problem = make_problem(*design, blank);
  const State one = state_with({{&effect("zero_offset"), {8e-3}}}),
              other = state_with({{&effect("wiggling"), {6e-3, 0.4}}});
  ASSERT_EQ(problem.targets.size(), 2U);
  const Eigen::Vector4d sd(0.2, 0.05, 0.004, 0.003);  // of two values, in typical values, and two ln reflectivities
  const Eigen::MatrixXd told = sd.cwiseAbs2().cwiseInverse().asDiagonal();
  const Question question{{}, one, other, {}, {}, told};
  const std::vector<double> sigma = differences_in_sigma(problem, question);
  for (std::size_t i = 0; i < design->size(); ++i) {
    const Design alone(design->camera_pointer(), design->physical(), {design->conditions()[i]});
    const auto at = [&](double size, double angle, double ln) {
      const State state = state_with({{&effect("wiggling"), {6e-3 + size, 0.4 + angle}}});
      const auto values = alone.predict(forward_model(state.terms, alone.camera(), design->physical()), 0, light + ln);
      return Eigen::VectorXd(
          Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
    };
    const auto slope = [&](double size, double angle, double ln) {
      return Eigen::VectorXd((at(size, angle, ln) - at(-size, -angle, -ln)) / 2);
    };
    const std::vector<FreeParameter>& free = effect("wiggling").free();
    constexpr double step = 1e-3;
    const bool first = problem.target[i] == 0;
    const std::vector<Eigen::VectorXd> open = {sd(0) * free[0].typical / (step * 5e-3) * slope(step * 5e-3, 0, 0),
                                               sd(1) * free[1].typical / step * slope(0, step, 0),
                                               sd(first ? 2 : 3) / step * slope(0, 0, step)};
    // The smaller of both directions; without open values it is larger.
    EXPECT_NEAR(sigma[i], brute_force(design->conditions()[i], one, other, open), 2e-2 * sigma[i]) << i;
  }
}

/// A difference that is certain but of no practical importance is ignored: the simulation itself is not that accurate.
TEST_F(Next, WhatIsBelowWhatMattersTellsNothing) {
  const Problem problem = make_problem(*design, blank);
  const State one = state_with({}), other = state_with({{&effect("source_phase"), {1e-3}}});
  ASSERT_EQ(effect("source_phase").free().size(), 1U);
  const std::vector<NextCondition> next = next_conditions(problem, {{{"source_phase"}, one, other, ""}});
  for (const NextCondition& best : next) EXPECT_LT(best.sigma, settings.min_distinction);
  EXPECT_EQ(best_condition(next), nullptr);
}

/// A campaign at one distance: an error proportional to the distance is not detectable, but is at another distance.
TEST_F(Next, ABlindEffectIsSentToWhereItShows) {
  std::erase_if(conditions, [](const io::Condition& c) { return std::abs(c.board_distance - 0.6) > 0.9; });
  for (io::Condition& c : conditions) c.board_distance = 2, c.reflectivity = 0.5;
  measure();
  std::erase_if(candidates, [](const auto& c) { return c->name() != "rail_scale" && c->name() != "rail_offset"; });
  const Term offset{&effect("rail_offset"), {3e-3}};
  const Problem problem = make_problem(*design, blank);
  const State state{{offset}, {}, {.jitter = 5e-4, .offset = 0, .light = 2e-3}};
  const Audit seen = audit(problem, {offset}, candidates);
  ASSERT_EQ(seen.effects.size(), 1U);
  ASSERT_TRUE(seen.effects[0].blind) << "an offset makes up for it";
  const std::vector<Question> questions = open_questions(problem, state, {}, {}, seen);
  ASSERT_EQ(questions.size(), 1U);
  EXPECT_EQ(questions[0].effects, std::vector<std::string>{"rail_scale"});
  // At the distance of the campaign the offset compensates half a typical scale: s z = -o.
  const double scale = questions[0].other.terms[1].values[0];
  EXPECT_NEAR(scale, effect("rail_scale").free()[0].typical / 2, 1e-12);
  EXPECT_LT(std::ranges::max(differences_in_sigma(problem, questions[0])), 0.1);
  const std::vector<NextCondition> next = next_conditions(problem, questions);
  ASSERT_EQ(next.size(), 1U);
  EXPECT_NEAR(std::abs(next[0].condition.board_distance - 2), 0.6, 1e-9) << "0.7 and 1.3 of the only distance";
  EXPECT_EQ(next[0].observable, distance);
  EXPECT_LT(next[0].difference, scale * 0.6);
  EXPECT_GT(next[0].difference, 0.8 * scale * 0.6) << "the offset, which is not quite sure, makes up for a part";
}

}  // namespace
}  // namespace tofgraph::diagnosis
