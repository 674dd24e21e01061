// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Condition to measure next: from a list that extends the campaign, the one in which two models differ most. The two
/// are tied models, a model at two values that these data do not determine, or the model with and without an effect to
/// which these data are blind.
#pragma once

#include "diagnosis/search/search.hpp"
#include "diagnosis/search/trials.hpp"

namespace tofgraph::diagnosis {

/// Variance of superpixels in conditions that were not measured: a + b I counts^2 of a sample, I counts of a tap's
/// mean. One law per observable, by least squares over the campaign's superpixels.
class NoiseLaw {
 public:
  /// @param light ln of each target's factor on the design's reflectivity
  NoiseLaw(const Problem& problem, std::span<const double> light);
  /// Values of 0; infinite variances if the campaign does not know the observable, if a board is too dark (10 standard
  /// deviations of a superpixel's amplitude) or if a tap is full. @param light as above, of one condition
  Observations blank(const Design& design, std::size_t condition, double light) const;

 private:
  struct Law {
    double constant = 0, slope = 0;
    bool known = false;
  };
  std::array<Law, observables> laws_;
};

/// Combinations of a few levels of each setting: distances of the campaign, between and beyond them; its integration
/// times, half and twice; its targets; boards that face the camera or are tilted by 20 deg to each side about x or y
/// (not if the data are means over boards), at the latest time since power-on. For boards that face the camera and
/// integration times of the campaign, also with one change each: twice that time since power-on, or one minute; a
/// single source; a lamp; a covered rail; a laser that measures the distance; the camera turned by 90 deg. Also
/// captures of a capped lens, up to the longest integration time of the camera.
/// @param light ln of each target's factor on the reflectivity: the darkest, the brightest and one between are listed
std::vector<io::Condition> candidate_conditions(const Problem& problem, std::span<const double> light);

/// Two models that both fit the campaign.
struct Question {
  std::vector<std::string> effects;  ///< two that are tied, or one
  State one, other;                  ///< with reflectivities of the problem's targets
  std::string experiment;            ///< advice of the effect's author
  /// Information of the campaign on the values of each model's effects, in typical values, and on the targets' ln
  /// reflectivities: within the remaining uncertainty they can compensate the other model in a new condition, too.
  /// Empty: they are fixed.
  Eigen::MatrixXd information_of_one = {}, information_of_other = {};
  std::string value = {};  ///< undetermined value of the effect; empty: its presence is in question
};

/// Questions about ties, about undetermined values of dropped effects (a small against a large one), and about each
/// blind effect at half its typical value. Each is refitted linearly to the campaign. Effects that fail are omitted.
/// @param found in the order of the state's terms, from the first added one
std::vector<Question> open_questions(const Problem& problem, const State& state,
                                     const std::vector<EffectFinding>& found, const std::vector<EffectFinding>& dropped,
                                     const Audit& audit);

struct NextCondition {
  std::vector<std::string> effects;
  std::string value;  ///< see Question
  io::Condition condition;
  double reflectivity = 0;  ///< reflectivity of its target, as the model estimates it
  /// Difference of the two models there: sqrt(d' C^-1 d), C with jitter, light and the uncertainty of the values.
  double sigma = 0;
  double measured_sigma = 0;   ///< largest sigma of the campaign's own conditions
  std::size_t observable = 0;  ///< observable that contributes most
  /// Root mean square over superpixels of the difference in that observable, SI, distances as depths, after the values
  /// have compensated what they can.
  double difference = 0;
  std::size_t candidates = 0;  ///< number of conditions compared
  std::string experiment;
};

/// True if it distinguishes the models, by a change of at least practical_threshold.
bool tells(const NextCondition& next);

/// Best condition for each question, for a blind effect that of the most visible amplitude; ties first, then
/// undetermined values, then the largest difference. Questions that no listed condition can answer are omitted.
std::vector<NextCondition> next_conditions(const Problem& problem, const std::vector<Question>& questions);

/// First that distinguishes its models, 10 % better than the measured conditions; nullptr: there is none.
const NextCondition* best_condition(const std::vector<NextCondition>& next);

/// Difference of a question's models in each of a problem's conditions, in standard deviations, whichever of the
/// two is right: the values of the other are refitted. After projecting out board position, camera offset and
/// light, the difference counts only if it reaches practical_threshold, because the simulation itself is not exact
/// below that.
std::vector<double> differences_in_sigma(const Problem& problem, const Question& question);

// ---- Distance of two models in conditions, after their values have compensated what they can ----

/// Information of the campaign on the values of a state's effects, in typical values, and on the targets' ln
/// reflectivities. Empty if the derivative of an effect fails.
Eigen::MatrixXd information_matrix(const Problem& problem, const State& state);

/// Distance of two models in each of a problem's conditions.
struct ModelDistance {
  std::vector<double> sigma;
  Column left;  ///< difference after the values have compensated what they can
};

/// Distances of the models of questions in the conditions of a problem. Consecutive questions mostly begin with the
/// same model, so its derivatives are kept.
class QuestionDistances {
 public:
  /// @param nuisances of these conditions; both must outlive this object
  QuestionDistances(const Problem& problem, const ConditionNuisances& nuisances)
      : problem_(problem), nuisances_(nuisances) {}
  const Problem& problem() const { return problem_; }
  const ConditionNuisances& nuisances() const { return nuisances_; }

  /// Distance of the two models, whichever is right: in each condition the smaller of the two directions.
  /// @param question must outlive this object @throws simulation::EffectError
  ModelDistance of(const Question& question);

 private:
  void linearise_first(const Question& question);

  const Problem& problem_;
  const ConditionNuisances& nuisances_;
  const Question* last_ = nullptr;  ///< whose first model is linearised below; null: none
  State first_;                     ///< without grid bias, with the nuisances of these conditions
  Column rows_;                     ///< its expectation
  std::vector<Column> columns_;     ///< derivatives by values and light; empty if the campaign determines nothing
};

}  // namespace tofgraph::diagnosis
