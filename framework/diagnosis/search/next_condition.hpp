// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Condition to measure next: of a list that extends those of the campaign, the one in which two models differ
/// most. Two tied models, a model at two values that these data do not tell, or the model with and without an effect
/// that these data could not have shown.
#pragma once

#include "diagnosis/search/audit.hpp"
#include "diagnosis/search/search.hpp"

namespace tofgraph::diagnosis {

/// Variance of superpixels in conditions that were not measured, as in those that were: a + b I counts^2 of a sample,
/// I counts of a tap's mean. One law an observable, least squares over the campaign's superpixels.
class NoiseLaw {
 public:
  /// @param light ln of each target's factor on the design's reflectivity
  NoiseLaw(const Problem& problem, std::span<const double> light);
  /// Values 0; infinite variances where the campaign knows nothing of the observable, and where a board is too dark
  /// (10 standard deviations of a superpixel's amplitude) or a tap is full. @param light as above, of one condition
  Observations blank(const Design& design, std::size_t condition, double light) const;

 private:
  struct Law {
    double constant = 0, slope = 0;
    bool known = false;
  };
  std::array<Law, observables> laws_;
};

/// The product of a few levels of each setting: distances of the campaign, between and beyond them; its integration
/// times, half and twice; its targets; boards that face the camera or are tilted by 20 deg to each side about x or y
/// (not where the data are means over boards), at the latest time since power-on. Where boards face the camera and the
/// time is one of the campaign's, each also with one thing changed: twice that time, a minute; a source alone; a lamp;
/// a covered rail; a laser that tells the distance; the camera turned by 90 deg. And captures of a capped lens, up to
/// the longest time of the camera.
/// @param light ln of each target's factor on the reflectivity: the darkest, the brightest and one between are listed
std::vector<io::Condition> candidate_conditions(const Problem& problem, std::span<const double> light);

/// Two models that both fit the campaign.
struct Question {
  std::vector<std::string> effects;  ///< two that are tied, or one
  State one, other;                  ///< with reflectivities of the problem's targets
  std::string experiment;            ///< what the effect's author advises
  /// Information of the campaign on the values of each one's effects, in their typical values, and on the targets' ln
  /// reflectivities, an information matrix: as far as it leaves them open, they make up for the other one in a new
  /// condition, too. Empty: they stay as they are.
  Eigen::MatrixXd information_of_one = {}, information_of_other = {};
  std::string value = {};  ///< of the effect, that is to be told; empty: whether it is there at all
};

/// Questions of a tie; of what was dropped as the campaign does not determine one of its values, at a small and a large
/// one; and of each blind effect at half its typical size beside the model. Each refitted linearly to the campaign.
/// Effects that give no number are left out. @param found in the order of the state's terms from the first added one on
std::vector<Question> open_questions(const Problem& problem, const State& state,
                                     const std::vector<EffectFinding>& found, const std::vector<EffectFinding>& dropped,
                                     const Audit& audit);

struct NextCondition {
  std::vector<std::string> effects;
  std::string value;  ///< see Question
  io::Condition condition;
  double reflectivity = 0;  ///< of its target, as the model found it
  /// By which the two models differ there: sqrt(d' C^-1 d), C with jitter, light and what the values leave open.
  double sigma = 0;
  double measured_sigma = 0;   ///< the largest of the campaign's own conditions
  std::size_t observable = 0;  ///< that carries most of it
  /// Root mean square over superpixels of that observable, SI, distances as depths, when the values have made up for
  /// what they can.
  double difference = 0;
  std::size_t candidates = 0;  ///< that were compared
  std::string experiment;
};

/// True if it distinguishes the models, by a change that is as large as matters (practical_threshold).
bool tells(const NextCondition& next);

/// The best condition for each question, for a blind effect that of whatever size shows best; ties first, then values
/// that are not told, then the largest difference. What no condition of the list shows is left out.
std::vector<NextCondition> next_conditions(const Problem& problem, const std::vector<Question>& questions);

/// The first that tells something, and more than what was measured by a tenth; nullptr: there is none.
const NextCondition* best_condition(const std::vector<NextCondition>& next);

/// Standard deviations of one condition by which a question's models differ, in each of a problem's conditions,
/// whichever of the two is right: the other one's values are fitted anew. What is left beside the board's place, the
/// camera's offset and the light counts only where it is as large as matters (practical_threshold): below that the
/// simulation itself is not exact.
std::vector<double> differences_in_sigma(const Problem& problem, const Question& question);

// ---- Distance of two models in conditions, after their values have made up for what they can ----

/// Information of the campaign on the values of a state's effects, in steps of their typical values, and on the
/// targets' ln reflectivities: an information matrix. Empty where an effect gives no derivative.
Eigen::MatrixXd information_matrix(const Problem& problem, const State& state);

/// Distance of two models in each of a problem's conditions.
struct ModelDistance {
  std::vector<double> sigma;
  Column left;  ///< of the difference, when the values have made up for what they can
};

/// The first model of a question in the conditions of a problem: the same for all questions that begin with it.
struct QuestionLinearisation {
  State one;                    ///< without grid bias, with the nuisances of these conditions
  Column rows;                  ///< that it expects
  std::vector<Column> columns;  ///< of its values and of the targets' light; none where the campaign determines nothing
};
/// @throws simulation::EffectError
QuestionLinearisation linearise_question(const Problem& problem, const Question& question,
                                         const ConditionNuisances& nuisances);

/// Returns true when two questions begin with the same model.
bool begin_alike(const Question& first, const Question& second);

/// Distance of the two models, whichever is right: of each condition the one that the other comes nearer to.
/// @throws simulation::EffectError
ModelDistance model_distance(const Problem& problem, const QuestionLinearisation& first, const Question& question);

}  // namespace tofgraph::diagnosis
