// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/subsets.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace tofgraph::diagnosis {
namespace {

struct Node {
  std::vector<std::size_t> choices;
  double gain = 0, merit = 0;
};

class Enumeration {
 public:
  Enumeration(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, std::span<const Choice> choices,
              const SubsetOptions& options)
      : information_(information), score_(score), choices_(choices), options_(options) {
    information_.diagonal().array() += options.prior;
  }

  std::vector<Subset> run() {
    std::vector<Node> level(1);  // the empty set
    bool complete = true;
    for (std::size_t size = 1; size <= options_.most_effects && !level.empty(); ++size) {
      if (best_.size() >= options_.kept) forget();
      level = enlarged(level, complete, size == options_.most_effects);
      note(level);
      complete = complete && level.size() <= options_.beam;
      if (level.size() <= options_.beam) continue;
      const auto middle = level.begin() + static_cast<std::ptrdiff_t>(options_.beam);
      std::ranges::nth_element(level, middle, std::greater<>{}, &Node::merit);
      level.resize(options_.beam);
    }
    std::vector<Subset> best;
    for (auto& [effects, node] : best_) best.push_back({std::move(node.choices), node.gain, node.merit, {}});
    std::ranges::sort(best, std::greater<>{}, &Subset::merit);
    if (best.size() > options_.kept) best.resize(options_.kept);
    for (Subset& subset : best) subset.values = solved(subset.choices, columns_of(subset.choices));
    return best;
  }

 private:
  std::vector<Eigen::Index> columns_of(std::span<const std::size_t> choices) const {
    std::vector<Eigen::Index> columns;
    for (const std::size_t c : choices) std::ranges::copy(choices_[c].columns, std::back_inserter(columns));
    return columns;
  }

  Eigen::VectorXd solved(std::span<const std::size_t> choices, const std::vector<Eigen::Index>& columns) const {
    if (choices.empty()) return {};
    return Eigen::MatrixXd(information_(columns, columns)).ldlt().solve(Eigen::VectorXd(score_(columns)));
  }

  bool has_effect(const Node& node, std::size_t effect) const {
    return std::ranges::any_of(node.choices, [&](std::size_t c) { return choices_[c].effect == effect; });
  }

  /// Gains of a node with each of the choices beside it; NaN where it has the effect already. @param first choice
  std::vector<double> gains(const Node& node, std::size_t first) const {
    const std::vector<Eigen::Index> held = columns_of(node.choices);
    const Eigen::MatrixXd across = information_(held, Eigen::all);
    const Eigen::MatrixXd inner = information_(held, held);
    const Eigen::LDLT<Eigen::MatrixXd> factors(inner);
    const Eigen::MatrixXd taken =
        held.empty() ? Eigen::MatrixXd(0, across.cols()) : Eigen::MatrixXd(factors.solve(across));
    const Eigen::VectorXd known = score_(held);
    std::vector<double> result(choices_.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t c = first; c < choices_.size(); ++c) {
      if (has_effect(node, choices_[c].effect)) continue;
      const std::vector<Eigen::Index>& own = choices_[c].columns;
      const Eigen::MatrixXd cross = across(Eigen::all, own), less = taken(Eigen::all, own);
      const Eigen::VectorXd score = Eigen::VectorXd(score_(own)) - less.transpose() * known;
      const Eigen::MatrixXd block = Eigen::MatrixXd(information_(own, own)) - cross.transpose() * less;
      result[c] = node.gain + score.dot(block.ldlt().solve(score));
    }
    return result;
  }

  /// All sets with one effect more. @param complete whether these are all sets of their size, so that each set with
  /// one more has one of them as its first @param last nothing comes of those that are not among the best
  std::vector<Node> enlarged(const std::vector<Node>& level, bool complete, bool last) const {
    std::vector<std::vector<Node>> grown(level.size());
    tbb::parallel_for(std::size_t{0}, level.size(), [&](std::size_t n) {
      const Node& node = level[n];
      const std::size_t first = complete && !node.choices.empty() ? node.choices.back() + 1 : 0;
      const std::vector<double> gain = gains(node, first);
      for (std::size_t c = first; c < choices_.size(); ++c) {
        const double merit = node.merit + gain[c] - node.gain - options_.price * choices_[c].dimension;
        if (!std::isfinite(merit) || (last && merit <= least_)) continue;
        Node next{node.choices, gain[c], merit};
        next.choices.insert(std::ranges::upper_bound(next.choices, c), c);
        grown[n].push_back(std::move(next));
      }
    });
    std::vector<Node> all;
    std::set<std::vector<std::size_t>> seen;
    for (std::vector<Node>& some : grown) {
      for (Node& node : some) {
        if (complete || seen.insert(node.choices).second) all.push_back(std::move(node));
      }
    }
    return all;
  }

  /// Keeps the best of each set of effects.
  void note(const std::vector<Node>& level) {
    for (const Node& node : level) {
      if (node.merit <= least_) continue;
      std::vector<std::size_t> effects;
      for (const std::size_t c : node.choices) effects.push_back(choices_[c].effect);
      std::ranges::sort(effects);
      const auto [at, added] = best_.try_emplace(std::move(effects), node);
      if (!added && node.merit > at->second.merit) at->second = node;
      if (best_.size() > 8 * options_.kept) forget();
    }
  }

  void forget() {
    std::vector<double> merits;
    for (const auto& [effects, node] : best_) merits.push_back(node.merit);
    const auto last = merits.begin() + static_cast<std::ptrdiff_t>(options_.kept - 1);
    std::ranges::nth_element(merits, last, std::greater<>{});
    least_ = *last;
    std::erase_if(best_, [&](const auto& entry) { return entry.second.merit < least_; });
  }

  Eigen::MatrixXd information_;
  const Eigen::VectorXd& score_;
  std::span<const Choice> choices_;
  const SubsetOptions& options_;
  std::map<std::vector<std::size_t>, Node> best_;
  double least_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options) {
  return Enumeration(information, score, choices, options).run();
}

}  // namespace tofgraph::diagnosis
