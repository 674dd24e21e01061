// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/node.hpp"

#include "graph/known_stages.hpp"
#include "graph/validation.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

namespace tofgraph::graph {

/// C view of a stream, and the texts that it points to.
struct Node::BorderStream {
  BorderStream(const Stream& stream, const std::string& from, const std::vector<const Channel*>& bound_channels) {
    words.resize(stream.channels.size() * 2);
    for (std::size_t i = 0; i < stream.channels.size(); ++i) {
      channels.push_back(stream.channels[i].view(words[2 * i], words[2 * i + 1]));
    }
    for (const Channel* channel : bound_channels) bound.push_back(channel != nullptr ? channel->name.c_str() : nullptr);
    view.size = sizeof view;
    view.channel_size = sizeof(tofgraph_channel);
    view.exposure_size = sizeof(tofgraph_exposure);
    view.node = from.c_str();
    view.camera = stream.camera ? &stream.camera->view() : nullptr;
    view.channels = channels.data();
    view.channel_count = channels.size();
    view.frames = stream.frames;
    view.known = stream.known;
    view.bound = bound.data();
    view.bound_count = bound.size();
    exposures = stream.all_exposures();
    view.exposures = exposures.data();
    view.exposure_count = exposures.size();
    view.source = stream.source.c_str();
  }
  BorderStream(BorderStream&&) = default;
  tofgraph_stream view{};
  std::vector<std::string> words;
  std::vector<tofgraph_channel> channels;
  std::vector<const char*> bound;
  std::vector<tofgraph_exposure> exposures;
};

Node::Node(std::size_t node_index, std::string node_name, config::Position position, const Plugin& plugin,
           ParameterValues values, Host& host)
    : index(node_index),
      name(std::move(node_name)),
      at(std::move(position)),
      values_(std::move(values)),
      instance_(plugin, name, host),
      host_(host),
      overwrite_(host.overwrite) {}

void Node::set_overwrite(bool allowed) {
  overwrite_ = overwrite_ || allowed;
  instance_.set_overwrite(overwrite_);
}

std::optional<Failure> Node::change(ParameterValues values) {
  if (changes_.empty()) first_parameters_ = values_.shown();
  auto failure = instance_.change(values.data());
  if (!failure) values_ = std::move(values);
  return failure;
}

bool Node::create(config::Diagnostics& diagnostics) {
  const std::optional<Failure> failure = instance_.create(values_.data());
  if (!failure || !failure->parameter.empty()) return tell(failure, diagnostics);
  defect_ = true;
  diagnostics.error(at,
                    fmt::format("node '{}' ({}): the stage cannot be created: {}", name, stage().name, failure->text),
                    fmt::format("this is a bug in the plugin {}", stage().file.path.string()));
  return false;
}

/// @returns true on success
bool Node::tell(const std::optional<Failure>& failure, config::Diagnostics& diagnostics) {
  if (!failure) return true;
  const config::Position where = failure->parameter.empty() ? at : values_.position_of(failure->parameter);
  const std::string which = failure->parameter.empty() ? "" : fmt::format(", parameter '{}'", failure->parameter);
  const auto parameter = std::ranges::find_if(
      stage().own_parameters, [&](const tofgraph_parameter& p) { return failure->parameter == p.name; });
  const bool known = failure->parameter.empty() || parameter != stage().own_parameters.end();
  defect_ = defect_ || failure->defect || !known;
  std::string hint;
  if (!known) hint = fmt::format("the stage has no such parameter: a bug in the plugin {}", stage().file.path.string());
  const std::string text = values_.text_of(failure->parameter);
  if (known && !failure->parameter.empty() && parameter->kind == TOFGRAPH_KIND_TEXT && text.starts_with('['))
    hint = "a list has no quotes: " + config::assignment(at, failure->parameter, text);
  diagnostics.error(where, fmt::format("node '{}' ({}){}: {}", name, stage().name, which, failure->message(stage())),
                    std::move(hint));
  return false;
}

bool Node::prepare(const std::vector<const Stream*>& inputs, const std::vector<std::string>& input_names,
                   config::Diagnostics& diagnostics) {
  std::vector<BorderStream> streams;
  std::vector<const Channel*> first_bound;
  bool right = true;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::vector<const Channel*> bound;
    right = bind(*inputs[i], bound, diagnostics) && right;
    streams.emplace_back(*inputs[i], input_names[i], bound);
    if (i == 0) first_bound = std::move(bound);
  }
  const Stream& first = *inputs.front();
  if (first.camera) right = values_.images_fit(first.camera->view(), diagnostics) && right;
  if (!right || !check_outputs(first, first_bound, diagnostics) || !outputs_avoid_inputs(diagnostics)) return false;
  output_stream_.stream = first;
  output_stream_.stream.exposures_known = !is_source();
  output_stream_.stream.history.push_back(index);
  for (const Channel& channel : first.channels) {
    if (is_alias(channel.name)) aliases_.push_back(channel.name);
  }
  std::erase_if(output_stream_.stream.channels, [](const Channel& channel) { return is_alias(channel.name); });
  announce_outputs(first_bound);

  std::vector<const tofgraph_stream*> views;
  for (const BorderStream& stream : streams) views.push_back(&stream.view);
  output_stream_.arriving = &streams.front().view;
  const bool prepared = tell(instance_.prepare(views, index, &output_stream_), diagnostics);
  output_stream_.arriving = nullptr;
  for (const std::string& warning : instance_.warnings()) diagnostics.warning(at, warning);
  if (!prepared || !choose_files(first.frames, diagnostics)) return false;
  output_stream_.stream.exposures_known = true;
  if (is_source()) size_images();
  if (is_source()) complete_history();
  if (is_source()) announce_bad_pixels(diagnostics);
  if (!check_exposures(diagnostics)) return false;
  for (const std::string& file : values_.files()) instance_.add_file(file);
  if (is_source() && output().camera) {
    if (!first.camera && !values_.images_fit(output().camera->view(), diagnostics)) return false;
    announce_rays();
  }
  if (output().camera && (is_source() || output_stream_.own_camera)) {
    const tofgraph_camera& camera = output().camera->view();
    const std::uint64_t extent[4] = {camera.height, camera.width, 3, 0};
    rays_ = BufferPool::lent(const_cast<float*>(camera.rays), channel_bytes(TOFGRAPH_TYPE_F32, 3, extent),
                             new io::CameraPtr(output().camera),  // a shared frame keeps its camera
                             [](void* owner) { delete static_cast<io::CameraPtr*>(owner); });
  }
  return true;
}

/// Rejects outputs that overwrite a file being read. Checked before the stage is prepared, which would only report that
/// the file exists.
bool Node::outputs_avoid_inputs(config::Diagnostics& diagnostics) {
  bool right = true;
  for (std::size_t i = 0; i < stage().parameter_count; ++i) {
    const tofgraph_parameter& p = stage().own_parameters[i];
    const bool writes = p.kind == TOFGRAPH_KIND_OUTPUT_FILE || p.kind == TOFGRAPH_KIND_FRAME_FILES;
    const std::string path = writes && values_.data()[i].text != nullptr ? values_.data()[i].text : "";
    if (path.empty()) continue;
    try {
      const std::string problem = io::input_problem(io::OutputPattern(path, values_.text_of(p.name)), host_.inputs);
      if (!problem.empty()) right = tell(Failure{p.name, problem}, diagnostics);
    } catch (const std::runtime_error&) {  // invalid pattern: reported where the files are chosen
    }
  }
  return right;
}

/// Chooses the output file names and checks them. @param frames number expected, 0 if unknown
bool Node::choose_files(std::uint64_t frames, config::Diagnostics& diagnostics) {
  bool right = true;
  outputs_.resize(stage().parameter_count);
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const tofgraph_parameter& p = stage().own_parameters[i];
    const bool each = p.kind == TOFGRAPH_KIND_FRAME_FILES;
    const std::string path = values_.data()[i].text != nullptr ? values_.data()[i].text : "";
    if ((!each && p.kind != TOFGRAPH_KIND_OUTPUT_FILE) || path.empty()) continue;
    std::string problem;
    try {
      outputs_[i] = io::OutputPattern(path, values_.text_of(p.name));
      if (each && !outputs_[i].numbered() && frames != 1) {
        outputs_[i] = outputs_[i].with_number();
        diagnostics.warning(
            at, fmt::format("{} names one file, but there may be more than one frame: they are written to {}", p.name,
                            outputs_[i].text()));
      }
      if (!each && outputs_[i].numbered()) problem = "is one file for the whole run: its name must not contain {frame}";
      if (problem.empty()) problem = io::output_problem(outputs_[i], overwrite_);
      for (const std::string& ending : split_words(p.choices))
        if (problem.empty()) problem = io::output_problem(outputs_[i].companion(ending), overwrite_);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    if (problem.empty()) continue;
    right = tell(Failure{p.name, problem}, diagnostics);
  }
  instance_.set_outputs(outputs_);
  return right;
}

/// Checks that there are as many raw images as announced exposures.
bool Node::check_exposures(config::Diagnostics& diagnostics) const {
  const std::size_t count = output().all_exposures().size();
  for (const Channel& channel : output().channels) {
    const ChannelInfo* known = known_channel(channel.name);
    const bool raw = !is_sink() && known != nullptr && known->shape[0] == 'P' && channel.rank > 0;
    if (!raw || channel.extent[0] == 0 || channel.extent[0] == count) continue;
    diagnostics.error(at,
                      fmt::format("node '{}' ({}): '{}' is {}, which is {} images, but {} {} exposures", name,
                                  stage().name, channel.name, channel.described(), channel.extent[0],
                                  !output().exposures.empty() ? "the source states that a frame has"
                                  : output().camera           ? "the camera's profile has"
                                                              : "without a profile there are",
                                  count),
                      fmt::format("give a profile with the {} exposures of the recording, e.g. --camera ./camera.yaml",
                                  channel.extent[0]));
    return false;
  }
  return true;
}

/// A recording names the stages that processed its channels; their corrections are known from their declarations.
void Node::complete_history() {
  if (host_.known_stages == nullptr) return;
  for (Channel& channel : output_stream_.stream.channels) {
    const std::vector<std::string> recorded = channel.applied;
    for (const std::string& stage_name : recorded) {
      if (stage_name == stage().name) continue;
      for (const std::string& word : host_.known_stages->added_by(stage_name)) {
        if (!channel.has_applied(word)) channel.applied.push_back(word);
      }
    }
  }
}

/// Sets the size of images that were announced before the source chose camera and exposures.
void Node::size_images() {
  for (const tofgraph_port& port : stage().own_ports) {
    Channel* channel = output_stream_.stream.find(port.channel);
    if (channel == nullptr || channel->made_by != index) continue;
    const Channel sized = output_channel(stage(), port, output(), index);
    for (std::size_t i = 0; i < sized.rank && sized.rank == channel->rank; ++i) {
      if (channel->extent[i] == 0) channel->extent[i] = sized.extent[i];
    }
  }
}

/// The rays are passed on as a channel, so that the origin of derived channels is known.
void Node::announce_rays() {
  const tofgraph_camera& camera = output().camera->view();
  Channel rays;
  rays.name = "rays";
  rays.type = TOFGRAPH_TYPE_F32;
  rays.rank = 3;
  rays.extent = {camera.height, camera.width, 3, 0};
  rays.made_by = index;
  output_stream_.stream.channels.push_back(std::move(rays));
}

/// Bad pixels from the camera's map; a warning if the map is not found and the frames bring no flags.
void Node::announce_bad_pixels(config::Diagnostics& diagnostics) {
  const io::CameraPtr& camera = output().camera;
  if (!camera) return;
  if (!camera->missing_bad_pixels.empty() && output().find("flags") == nullptr)
    diagnostics.warning(at,
                        fmt::format("the bad pixels of the camera '{}' are unknown: the recorded profile names the map "
                                    "{}, which is not found from here",
                                    camera->view().name, camera->missing_bad_pixels),
                        "name the profile itself: --camera ./camera.yaml, or camera: ./camera.yaml in the pipeline");
  bad_pixels_ = BadPixels(output_stream_.stream, index);
  if (!bad_pixels_.any()) return;
  instance_.add_file(camera->bad_pixels_file.string());
  instance_.add_note(fmt::format("{} bad pixels of the camera are flagged and invalid", bad_pixels_.count()));
}

int Node::call_process(std::span<tofgraph_frame* const> frames) {
  if (!validating_) return instance_.process(frames);
  try {
    const Validation validation;
    const int status = instance_.process(frames);
    validation.check_memory();
    if (status == TOFGRAPH_STATUS_OK && !is_sink()) Validation::check_flags(*frames.front());
    if (status == TOFGRAPH_STATUS_OK && is_source())
      Validation::check_metadata(frames.front()->metadata, output().known);
    return status;
  } catch (const BrokenPromise& error) {
    throw BrokenPromise(fmt::format("{}\n         plugin {}", error.what(), stage().file.path.string()));
  }
}

bool Node::process(tofgraph_frame* const* frames, std::size_t count) {
  struct ViewsEnd {
    std::span<tofgraph_frame* const> frames;
    ~ViewsEnd() {
      for (tofgraph_frame* frame : frames) frame->views_ended();
    }
  };
  int status = TOFGRAPH_STATUS_OK;
  {
    const ViewsEnd end{{frames, count}};
    status = call_process(end.frames);
  }
  if (status == TOFGRAPH_STATUS_END && !is_sink()) return false;
  if (status == TOFGRAPH_STATUS_END) throw BrokenPromise("the sink returned END, which only a source or filter may do");
  if (max_frames_ && frames_made_++ == *max_frames_) {
    exceeded_max_frames_ = true;
    return false;
  }
  tofgraph_frame& frame = *frames[0];
  for (const std::string& alias : aliases_) frame.slot(alias).buffer = {};
  if (output_stream_.own_camera || (is_source() && output().camera)) {  // rays of the outgoing camera
    const tofgraph_camera& camera = output().camera->view();
    tofgraph_frame::Channel& rays = frame.slot("rays");
    const std::uint64_t extent[4] = {camera.height, camera.width, 3, 0};
    rays.buffer = rays_;
    rays.type = TOFGRAPH_TYPE_F32;
    rays.rank = 3;
    std::copy_n(extent, 4, rays.extent);
  }
  if (bad_pixels_.any()) bad_pixels_.mark(frame);
  if (!is_sink()) verify(frame);
  return true;
}

void Node::verify(const tofgraph_frame& frame) const {
  std::size_t found = 0;
  for (const Channel& promised : output().channels) {
    const tofgraph_frame::Channel* channel = frame.find(promised.name);
    if (channel == nullptr)
      throw BrokenPromise(fmt::format("the stage did not write '{}', which it had announced", promised.name));
    ++found;
    bool same = channel->type == promised.type && channel->rank == promised.rank;
    for (std::uint32_t i = 0; same && i < promised.rank; ++i)
      same = promised.extent[i] == 0 || promised.extent[i] == channel->extent[i];
    if (same) continue;
    Channel actual;
    actual.type = channel->type;
    actual.rank = channel->rank;
    std::copy_n(channel->extent, 4, actual.extent.begin());
    throw BrokenPromise(
        fmt::format("'{}' is {}, but {} was announced", promised.name, actual.described(), promised.described()));
  }
  for (const auto& channel : frame.channels) {
    if (channel.buffer && found < frame.channels.size() && output().find(channel.name) == nullptr) {
      throw BrokenPromise(fmt::format("the stage wrote '{}', which it had not announced", channel.name));
    }
  }
}

}  // namespace tofgraph::graph
