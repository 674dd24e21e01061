// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/known_stages.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::graph {
namespace {

using Names = std::vector<std::string>;

constexpr std::size_t longest_way = 3;  // longest chain of stages that is worth suggesting

bool has(const Names& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

bool has_any(const Names& names, const Names& of) {
  return std::ranges::any_of(of, [&](const std::string& name) { return has(names, name); });
}

Names words(const nlohmann::json& object, const char* key, char separator = ' ') {
  std::string text = object.value(key, "");
  std::ranges::replace(text, separator, ' ');
  return split_words(text);
}

/// Required inputs of a stage; if all ports are optional, one of them.
std::vector<Names> needed_by(const nlohmann::json& stage) {
  std::vector<Names> needed;
  Names any;
  for (const nlohmann::json& port : stage.at("ports")) {
    Names channels = words(port, "channel", '|');
    if (port.at("direction") == "out" || channels.front() == "*") continue;
    if (channels.size() > 1) std::erase(channels, "distance");  // a half path for a length: only if assumed
    if (!port.value("optional", false))
      needed.push_back(std::move(channels));
    else if (port.at("direction") == "in")
      std::ranges::move(channels, std::back_inserter(any));
  }
  if (needed.empty() && !any.empty()) needed.push_back(std::move(any));
  return needed;
}

}  // namespace

/// Filters. Channels that they only change, or make only sometimes, are not used for advice.
const std::vector<KnownStages::Step>& KnownStages::steps() const {
  if (steps_) return *steps_;
  steps_.emplace();
  std::vector<PluginFile> filters;
  std::ranges::copy_if(registry_.files(), std::back_inserter(filters),
                       [](const PluginFile& file) { return file.kind == "filter"; });
  const auto described = registry_.describe(filters);
  for (const PluginFile& file : filters) {
    const nlohmann::json& stage = described.at(file.path.string());
    if (stage.contains("error")) continue;
    Step step{file.name, {}, needed_by(stage), {}};
    for (const nlohmann::json& port : stage.at("ports")) {
      for (const std::string& word : words(port, "adds")) step.adds.push_back(word);
      const std::string channel = port.value("channel", "");
      if (port.at("direction") == "out" && !port.value("optional", false) && channel != "*")
        step.makes.push_back(channel);
    }
    steps_->push_back(std::move(step));
  }
  return *steps_;
}

Names KnownStages::added_by(const std::string& stage) const {
  for (const Step& step : steps()) {
    if (step.stage == stage) return step.adds;
  }
  return {};
}

/// "'decode' (four_phase_decoder)" if the pipeline has such a node, else all suitable stages.
std::string KnownStages::named(const Names& stages) const {
  Names nodes;
  for (const NodeSpec& node : nodes_) {
    if (has(stages, node.stage)) nodes.push_back(fmt::format("'{}' ({})", node.name, node.stage));
  }
  const Names& all = nodes.empty() ? stages : nodes;
  std::string text = all.front();
  for (std::size_t i = 1; i < all.size(); ++i) text += (i + 1 < all.size() ? ", " : " or ") + all[i];
  return text;
}

/// Stages that compute one of the channels from the available ones.
Names KnownStages::makers_of(const Names& channels, const Names& have, const std::string& except) const {
  Names makers;
  for (const Step& step : steps()) {
    const bool served = std::ranges::all_of(step.reads, [&](const Names& port) { return has_any(have, port); });
    if (step.stage != except && served && has_any(step.makes, channels)) makers.push_back(step.stage);
  }
  return makers;
}

/// Missing channels that the first of the given stages reads.
Names KnownStages::missing_for(const Names& stages, const Names& have) const {
  Names missing;
  for (const Step& step : steps()) {
    if (step.stage != stages.front()) continue;
    for (const Names& port : step.reads) {
      if (!has_any(have, port)) std::ranges::copy(port, std::back_inserter(missing));
    }
  }
  return missing;
}

std::string KnownStages::way_to(const Names& channels, const Stream& stream, const std::string& stage) const {
  std::vector<Names> have(1);  // available channels, by number of stages
  for (const Channel& channel : stream.channels) have.front().push_back(channel.name);
  std::vector<Names> way;  // in reverse order
  while (way.empty()) {
    const Names makers = makers_of(channels, have.back(), stage);
    if (!makers.empty()) {
      way.push_back(makers);
      break;
    }
    Names next = have.back();
    for (const Step& step : steps()) {
      const bool served =
          std::ranges::all_of(step.reads, [&](const Names& port) { return has_any(have.back(), port); });
      for (const std::string& made : step.makes) {
        if (served && !has(next, made)) next.push_back(made);
      }
    }
    if (have.size() == longest_way || next.size() == have.back().size()) return {};
    have.push_back(std::move(next));
  }
  for (have.pop_back(); !have.empty(); have.pop_back()) {
    const Names makers = makers_of(missing_for(way.back(), have.back()), have.back(), stage);
    if (makers.empty()) return {};
    way.push_back(makers);
  }
  std::string text = "put ";
  for (std::size_t i = way.size(); i-- > 0;) text += named(way[i]) + (i > 0 ? ", then " : " before it");
  return text;
}

}  // namespace tofgraph::graph
