// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/alternatives.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

namespace tofgraph::diagnosis {
namespace {

/// Largest number of columns of one choice.
inline constexpr int max_columns = 24;
using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_columns, max_columns>;

struct Node {
  std::vector<std::size_t> choices;
  double gain = 0, merit = 0;
};

/// A node with one more choice.
struct Entry {
  std::size_t node = 0, choice = 0;
  double gain = 0, merit = 0;
};

class Enumeration {
 public:
  Enumeration(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, std::span<const Choice> choices,
              const SubsetOptions& options)
      : information_(information), score_(score), choices_(choices), options_(options) {
    information_.diagonal().array() += options.prior;
    for (const Choice& choice : choices) {
      if (choice.columns.size() > max_columns)
        throw std::invalid_argument(fmt::format("an effect with {} sizes at once; at most {} can be searched",
                                                choice.columns.size(), max_columns));
    }
  }

  std::vector<Subset> run() {
    if (choices_.empty() || options_.max_effects == 0) return {};
    const double enough = options_.share_of_all * gain_of_all() - options_.less_than_all;
    std::vector<Node> level(1);  // the empty set
    bool complete = true, reached = false;
    for (std::size_t size = 1; size <= options_.max_effects && !level.empty(); ++size) {
      const std::vector<Entry> entries = enlarged(level, complete);
      keep(level, entries);
      const bool last = reached;
      reached = std::ranges::any_of(best_, [&](const Subset& s) { return s.merit > 0 && s.gain >= enough; });
      if (last || size == options_.max_effects) break;
      level = chosen(level, entries, complete ? 1 : size);
      complete = complete && entries.size() <= options_.beam;
    }
    std::ranges::stable_sort(best_, std::greater<>{}, &Subset::merit);
    for (Subset& subset : best_) subset.values = solved(subset.choices, columns_of(subset.choices));
    return std::move(best_);
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

  /// Gains of a node with each further choice; NaN if the node has the effect already. @param first choice evaluated
  std::vector<double> gains(const Node& node, std::size_t first) const {
    const std::vector<Eigen::Index> present = columns_of(node.choices);
    const Eigen::MatrixXd across = information_(present, Eigen::all);
    Eigen::MatrixXd taken = across;
    Eigen::VectorXd score = score_;
    if (!present.empty()) {
      const Eigen::MatrixXd inner = information_(present, present);
      taken = inner.ldlt().solve(across);
      const Eigen::VectorXd known = score_(present);
      for (Eigen::Index c = 0; c < score.size(); ++c) score(c) -= taken.col(c).dot(known);
    }
    std::vector<double> result(choices_.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t c = first; c < choices_.size(); ++c) {
      if (!has_effect(node, choices_[c].effect)) result[c] = node.gain + gain_beside(across, taken, score, c);
    }
    return result;
  }

  /// s' M^-1 s of one choice, with the present columns projected out: by Cholesky factors, in place, because this is
  /// done a million times.
  double gain_beside(const Eigen::MatrixXd& across, const Eigen::MatrixXd& taken, const Eigen::VectorXd& score,
                     std::size_t choice) const {
    const std::vector<Eigen::Index>& own = choices_[choice].columns;
    const auto size = static_cast<Eigen::Index>(own.size());
    Small factor(size, size);
    Small left(size, 1);
    double gain = 0;
    for (Eigen::Index a = 0; a < size; ++a) {
      const Eigen::Index at = own[static_cast<std::size_t>(a)];
      left(a) = score(at);
      for (Eigen::Index b = 0; b <= a; ++b) {
        const Eigen::Index to = own[static_cast<std::size_t>(b)];
        double value = information_(at, to) - across.col(at).dot(taken.col(to));
        for (Eigen::Index k = 0; k < b; ++k) value -= factor(a, k) * factor(b, k);
        // In a direction that is already present only rounding errors remain.
        factor(a, b) = a == b ? std::sqrt(std::max(value, 1e-12 * information_(at, at))) : value / factor(b, b);
      }
      for (Eigen::Index k = 0; k < a; ++k) left(a) -= factor(a, k) * left(k);
      left(a) /= factor(a, a);
      gain += left(a) * left(a);
    }
    return gain;
  }

  /// Upper limit of the gain of any set: that of all columns together.
  double gain_of_all() const { return score_.dot(information_.ldlt().solve(score_)); }

  /// All sets with one more effect. @param complete true: these are all sets of their size, so each larger set extends
  /// exactly one of them by a later choice
  std::vector<Entry> enlarged(const std::vector<Node>& level, bool complete) const {
    std::vector<std::vector<Entry>> grown(level.size());
    tbb::parallel_for(std::size_t{0}, level.size(), [&](std::size_t n) {
      const Node& node = level[n];
      const std::size_t first = complete && !node.choices.empty() ? node.choices.back() + 1 : 0;
      const std::vector<double> gain = gains(node, first);
      for (std::size_t c = first; c < choices_.size(); ++c) {
        const double merit = node.merit + gain[c] - node.gain - options_.price * choices_[c].dimension;
        if (std::isfinite(merit)) grown[n].push_back({n, c, gain[c], merit});
      }
    });
    std::vector<Entry> all;
    for (const std::vector<Entry>& some : grown) all.insert(all.end(), some.begin(), some.end());
    return all;
  }

  static Node made(const std::vector<Node>& level, const Entry& entry) {
    Node node{level[entry.node].choices, entry.gain, entry.merit};
    node.choices.insert(std::ranges::upper_bound(node.choices, entry.choice), entry.choice);
    return node;
  }

  /// The best sets, at most the width of the beam. @param times number of times that a set may occur
  std::vector<Node> chosen(const std::vector<Node>& level, std::vector<Entry> entries, std::size_t times) const {
    if (const std::size_t most = options_.beam * times; entries.size() > most) {
      std::ranges::nth_element(entries, entries.begin() + static_cast<std::ptrdiff_t>(most), std::greater<>{},
                               &Entry::merit);
      entries.resize(most);
    }
    std::ranges::stable_sort(entries, std::greater<>{}, &Entry::merit);
    std::vector<Node> nodes;
    std::set<std::vector<std::size_t>> seen;
    for (const Entry& entry : entries) {
      Node node = made(level, entry);
      if (nodes.size() < options_.beam && (times == 1 || seen.insert(node.choices).second))
        nodes.push_back(std::move(node));
    }
    return nodes;
  }

  /// Stores the best sets of a size.
  void keep(const std::vector<Node>& level, const std::vector<Entry>& entries) {
    std::map<std::vector<std::size_t>, Node> best;  // best node per set of effects
    double least = -std::numeric_limits<double>::infinity();
    const auto merit = [](const auto& entry) { return entry.second.merit; };
    for (const Entry& entry : entries) {
      if (entry.merit <= least) continue;
      Node node = made(level, entry);
      const std::size_t kept = node.choices.size() == 1 ? options_.singles : options_.kept;
      std::vector<std::size_t> effects;
      for (const std::size_t c : node.choices) effects.push_back(choices_[c].effect);
      std::ranges::sort(effects);
      const auto [at, first] = best.try_emplace(std::move(effects), node);
      if (!first && node.merit > at->second.merit) at->second = std::move(node);
      if (best.size() <= kept) continue;
      best.erase(std::ranges::min_element(best, {}, merit));
      least = merit(*std::ranges::min_element(best, {}, merit));
    }
    for (const auto& [effects, node] : best) best_.push_back({node.choices, node.gain, node.merit, {}});
  }

  Eigen::MatrixXd information_;
  const Eigen::VectorXd& score_;
  std::span<const Choice> choices_;
  const SubsetOptions& options_;
  std::vector<Subset> best_;
};

}  // namespace

std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options) {
  return Enumeration(information, score, choices, options).run();
}

}  // namespace tofgraph::diagnosis
