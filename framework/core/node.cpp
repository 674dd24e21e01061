// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/node.hpp"

#include "core/host_calls.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

namespace tofgraph::core {

/// The border's view of a stream, and the texts that it points to.
struct Node::BorderStream {
  BorderStream(const Stream& stream, const std::string& from, const std::vector<const Channel*>& bound_channels) {
    words.resize(stream.channels.size() * 2);
    for (std::size_t i = 0; i < stream.channels.size(); ++i) {
      channels.push_back(stream.channels[i].view(words[2 * i], words[2 * i + 1]));
    }
    for (const Channel* channel : bound_channels) bound.push_back(channel != nullptr ? channel->name.c_str() : nullptr);
    view.size = sizeof view;
    view.channel_size = sizeof(tofgraph_channel);
    view.node = from.c_str();
    view.camera = stream.camera ? &stream.camera->view() : nullptr;
    view.channels = channels.data();
    view.channel_count = channels.size();
    view.frames = stream.frames;
    view.known = stream.known;
    view.bound = bound.data();
    view.bound_count = bound.size();
  }
  BorderStream(BorderStream&&) = default;
  tofgraph_stream view{};
  std::vector<std::string> words;
  std::vector<tofgraph_channel> channels;
  std::vector<const char*> bound;
};

Node::Node(std::size_t node_index, std::string node_name, Position position, const tofgraph_descriptor& stage,
           ParameterValues values, NodeHost& host)
    : index(node_index),
      name(std::move(node_name)),
      at(std::move(position)),
      stage_(stage),
      values_(std::move(values)),
      host_(host) {}

Node::~Node() {
  if (self_ != nullptr) stage_.destroy(self_);
}

bool Node::create(Diagnostics& diagnostics) {
  last_failure() = {};
  if (stage_.create(&host_table(), this, values_.data(), &self_) == TOFGRAPH_OK) return true;
  self_ = nullptr;
  diagnostics.error(at,
                    fmt::format("node '{}' ({}): the stage cannot be made: {}", name, stage_.name, last_failure().text),
                    "this is a defect of the plugin");
  return false;
}

bool Node::prepare(const std::vector<const Stream*>& inputs, const std::vector<std::string>& input_names,
                   Diagnostics& diagnostics) {
  std::vector<BorderStream> streams;
  std::vector<const Channel*> first_bound;
  bool right = true;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::vector<const Channel*> bound;
    right = bind(*inputs[i], bound, diagnostics) && right;
    streams.emplace_back(*inputs[i], input_names[i], bound);
    if (i == 0) first_bound = std::move(bound);
  }
  if (!right) return false;
  if (!check_outputs(*inputs.front(), first_bound, diagnostics)) return false;
  output_ = *inputs.front();
  output_.history.push_back(index);
  announce_outputs(first_bound);

  std::vector<const tofgraph_stream*> views;
  for (const BorderStream& stream : streams) views.push_back(&stream.view);
  last_failure() = {};
  preparing_ = &diagnostics;
  arriving_ = &streams.front().view;
  const int status = stage_.prepare(self_, views.data(), views.size());
  arriving_ = nullptr;
  preparing_ = nullptr;
  if (status == TOFGRAPH_OK && last_failure().text.empty()) {
    if (is_source() && output_.camera) announce_rays();
    return true;
  }
  const Failure& failure = last_failure();
  const Position where = failure.parameter.empty() ? at : values_.position_of(failure.parameter);
  const std::string which = failure.parameter.empty() ? "" : fmt::format(", parameter '{}'", failure.parameter);
  diagnostics.error(where, fmt::format("node '{}' ({}){}: {}", name, stage_.name, which,
                                       failure.text.empty() ? "failed without saying why" : failure.text));
  return false;
}

/// The rays travel as a channel, so that what is computed from them is known.
void Node::announce_rays() {
  const tofgraph_camera& camera = output_.camera->view();
  Channel rays;
  rays.name = "rays";
  rays.type = TOFGRAPH_F32;
  rays.rank = 3;
  rays.extent = {camera.height, camera.width, 3, 0};
  rays.made_by = index;
  output_.channels.push_back(std::move(rays));
}

void Node::fail(const char* otherwise) const {
  throw std::runtime_error(last_failure().text.empty() ? otherwise : last_failure().text);
}

bool Node::process(tofgraph_frame* const* frames, std::size_t count) {
  if (!last_failure().text.empty()) last_failure() = {};
  const int status = stage_.process(self_, frames, count);
  for (tofgraph_frame* frame : std::span(frames, count)) frame->views_ended();
  if (status == TOFGRAPH_END && !is_sink()) return false;
  if (status != TOFGRAPH_OK) fail("the stage failed without saying why");
  tofgraph_frame& frame = *frames[0];
  if (own_camera_ || (is_source() && output_.camera)) {  // the rays of the camera that leaves
    const tofgraph_camera& camera = output_.camera->view();
    tofgraph_frame::Channel& rays = frame.slot("rays");
    const std::uint64_t extent[4] = {camera.height, camera.width, 3, 0};
    rays.buffer =
        BufferPool::lent(const_cast<float*>(camera.rays), channel_bytes(TOFGRAPH_F32, 3, extent), nullptr, nullptr);
    rays.type = TOFGRAPH_F32;
    rays.rank = 3;
    std::copy_n(extent, 4, rays.extent);
  }
  if (!is_sink()) verify(frame);
  return true;
}

void Node::verify(const tofgraph_frame& frame) const {
  std::size_t found = 0;
  for (const Channel& promised : output_.channels) {
    const tofgraph_frame::Channel* channel = frame.find(promised.name);
    if (channel == nullptr)
      throw std::runtime_error(fmt::format("the stage did not write '{}', which it had announced", promised.name));
    ++found;
    bool same = channel->type == promised.type && channel->rank == promised.rank;
    for (std::uint32_t i = 0; same && i < promised.rank; ++i)
      same = promised.extent[i] == 0 || promised.extent[i] == channel->extent[i];
    if (same) continue;
    Channel actual;
    actual.type = channel->type;
    actual.rank = channel->rank;
    std::copy_n(channel->extent, 4, actual.extent.begin());
    throw std::runtime_error(
        fmt::format("'{}' is {}, announced was {}", promised.name, actual.described(), promised.described()));
  }
  for (const auto& channel : frame.channels) {
    if (channel.buffer && found < frame.channels.size() && output_.find(channel.name) == nullptr) {
      throw std::runtime_error(fmt::format("the stage wrote '{}', which it had not announced", channel.name));
    }
  }
}

void Node::finish() {
  if (stage_.finish == nullptr || self_ == nullptr) return;
  last_failure() = {};
  if (stage_.finish(self_) != TOFGRAPH_OK) fail("the stage could not finish and did not say why");
}

void Node::stop() {
  if (stage_.stop == nullptr || self_ == nullptr) return;
  last_failure() = {};
  stage_.stop(self_);
  if (const Failure failure = std::exchange(last_failure(), {}); !failure.text.empty() && host_.message)
    host_.message(name, "cannot be stopped: " + failure.text, true);
}

}  // namespace tofgraph::core
