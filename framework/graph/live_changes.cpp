// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/live_changes.hpp"

#include "graph/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <stdexcept>

namespace tofgraph::graph {
namespace {

constexpr std::size_t max_waiting = 64, max_done = 20;

const tofgraph_parameter& live_parameter(const Node& node, const std::string& name) {
  std::vector<std::string> live;
  for (const tofgraph_parameter& p : std::span(node.stage().own_parameters)) {
    if ((p.flags & TOFGRAPH_PARAMETER_LIVE) != 0 && name == p.name) return p;
    if ((p.flags & TOFGRAPH_PARAMETER_LIVE) != 0) live.emplace_back(p.name);
  }
  const bool known = std::ranges::any_of(std::span(node.stage().own_parameters),
                                         [&](const tofgraph_parameter& p) { return name == p.name; });
  throw std::runtime_error(fmt::format(
      "the parameter '{}' of '{}' ({}) {}; {}", name, node.name, node.stage().name,
      known ? "cannot change while the pipeline runs" : "does not exist",
      live.empty() ? "this stage has none that can" : fmt::format("those that can change: {}", fmt::join(live, ", "))));
}

std::string problem_of(const Node& node, const config::Diagnostics& mistakes) {
  const config::Diagnostic& first = mistakes.all().front();
  return fmt::format("node '{}' ({}): {}{}", node.name, node.stage().name, first.message,
                     first.hint.empty() ? "" : "; " + first.hint);
}

nlohmann::json bound(double value) { return std::isnan(value) ? nlohmann::json() : nlohmann::json(value); }

}  // namespace

Node& LiveChanges::node_named(const std::string& name) const {
  std::vector<std::string> names;
  for (const auto& node : graph_.nodes()) {
    if (node->name == name) return *node;
    names.push_back(node->name);
  }
  throw std::runtime_error(fmt::format("there is no node '{}'; {}", name, config::suggestion(name, names, "nodes")));
}

nlohmann::json LiveChanges::request(const std::string& node_name, const std::string& parameter,
                                    const std::string& value) {
  Node& node = node_named(node_name);
  const tofgraph_parameter& declared = live_parameter(node, parameter);
  std::unique_lock lock(mutex_);
  config::Diagnostics mistakes;
  static_cast<void>(node.values().with(declared, value, mistakes));
  if (!mistakes.ok()) throw std::runtime_error(problem_of(node, mistakes));
  auto request = std::make_shared<Request>(Request{&node, parameter, value, {}, 0, false, false});
  if (ended_) throw std::runtime_error("the run is over");
  if (waiting_.size() >= max_waiting) throw std::runtime_error("too many changes wait for the next frame");
  waiting_.push_back(request);
  pending_ = true;
  settled_.wait_for(lock, std::chrono::seconds(2), [&] { return request->settled; });
  if (!request->problem.empty()) throw std::runtime_error(request->problem);
  nlohmann::json result = {{"node", node.name}, {"parameter", parameter}, {"value", value}};
  if (request->settled)
    result["frame"] = request->frame;
  else
    result["pending"] = request->told_pending = true;
  return result;
}

void LiveChanges::apply(std::uint64_t frame) {
  const std::scoped_lock lock(mutex_);
  pending_ = false;
  for (const std::shared_ptr<Request>& request : waiting_) settle(*request, frame);
  waiting_.clear();
  settled_.notify_all();
}

void LiveChanges::settle(Request& request, std::uint64_t frame) {
  Node& node = *request.node;
  // Uses the current values: an earlier request for the same node may have changed others.
  config::Diagnostics mistakes;
  ParameterValues values = node.values().with(live_parameter(node, request.parameter), request.value, mistakes);
  if (!mistakes.ok()) {
    request.problem = problem_of(node, mistakes);
  } else if (const auto failure = node.change(std::move(values))) {
    request.problem = fmt::format("node '{}' ({}), parameter '{}': {}", node.name, node.stage().name,
                                  failure->parameter.empty() ? request.parameter : failure->parameter,
                                  failure->message(node.stage()));
  } else {
    request.frame = frame;
    node.add_change({{"frame", frame}, {"parameter", request.parameter}, {"value", request.value}});
  }
  request.settled = true;
  keep(request, {{"frame", frame}});
}

void LiveChanges::keep(const Request& request, nlohmann::json entry) {
  if (!request.problem.empty() && !request.told_pending) return;  // reported in the answer to the request
  entry.update({{"node", request.node->name}, {"parameter", request.parameter}, {"value", request.value}});
  if (!request.problem.empty()) entry["problem"] = request.problem;
  done_.push_back(std::move(entry));
  if (done_.size() > max_done) done_.erase(done_.begin());
}

void LiveChanges::end() {
  const std::scoped_lock lock(mutex_);
  ended_ = true;
  pending_ = false;
  for (const std::shared_ptr<Request>& request : waiting_) {
    request->problem = "the run is over";
    request->settled = true;
    keep(*request, nlohmann::json::object());
  }
  waiting_.clear();
  settled_.notify_all();
}

nlohmann::json LiveChanges::parameters(const Node& node) const {
  const std::scoped_lock lock(mutex_);
  nlohmann::json all = nlohmann::json::array();
  for (const tofgraph_parameter& p : std::span(node.stage().own_parameters)) {
    if ((p.flags & TOFGRAPH_PARAMETER_LIVE) == 0) continue;  // others may contain paths and addresses
    const auto index = static_cast<std::size_t>(&p - node.stage().own_parameters.data());
    const tofgraph_value& value = node.values().data()[index];
    all.push_back({{"name", p.name},
                   {"unit", p.unit},
                   {"text", p.text},
                   {"choices", split_words(p.choices)},
                   {"min", bound(p.minimum)},
                   {"max", bound(p.maximum)},
                   {"type", p.kind == TOFGRAPH_KIND_BOOL      ? "bool"
                            : p.kind == TOFGRAPH_KIND_INTEGER ? "integer"
                            : p.kind == TOFGRAPH_KIND_NUMBER  ? "number"
                            : p.kind == TOFGRAPH_KIND_CHOICE  ? "choice"
                                                              : "other"},
                   {"number", p.kind == TOFGRAPH_KIND_NUMBER ? bound(value.number) : nlohmann::json(value.integer)},
                   {"value", node.values().text_of(p.name)}});
  }
  return all;
}

nlohmann::json LiveChanges::done() const {
  const std::scoped_lock lock(mutex_);
  return done_;
}

nlohmann::json state_json(const Graph& graph, std::span<const TimeHistogram> times, const LiveChanges& changes) {
  nlohmann::json nodes = nlohmann::json::array();
  for (const auto& node : graph.nodes()) {
    nlohmann::json inputs = nlohmann::json::array(), channels = nlohmann::json::array();
    for (const std::size_t input : graph.inputs(node->index)) inputs.push_back(graph.nodes()[input]->name);
    for (const Channel& channel : node->output().channels) {
      if (channel.name == "rays" || node->is_sink()) continue;
      channels.push_back({{"name", channel.name},
                          {"unit", channel.unit},
                          {"text", channel_text(channel)},
                          {"new", channel.made_by == node->index}});
    }
    const TimeHistogram& time = times[node->index];
    nodes.push_back({{"name", node->name},
                     {"stage", node->stage().name},
                     {"kind", node->stage().kind},
                     {"summary", node->stage().summary},
                     {"inputs", std::move(inputs)},
                     {"channels", std::move(channels)},
                     {"parameters", changes.parameters(*node)},
                     {"frames", time.count()},
                     {"median_s", time.quantile(0.5)},
                     {"p99_s", time.quantile(0.99)},
                     {"max_s", time.maximum()}});
  }
  return {{"pipeline", graph.name()}, {"nodes", std::move(nodes)}, {"changes", changes.done()}};
}

}  // namespace tofgraph::graph
