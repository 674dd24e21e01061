// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a stage is written: a class whose members are its contract, plus one `process`.
///
///     struct Scale final : tofgraph::Filter {
///       InOut<float> depth{this, "depth", {.text = "what is scaled"}};
///       Param<double> factor{this, "factor", {.fallback = "1.01", .min = 0.5, .max = 2, .text = "multiplier"}};
///       void process(Frame& frame) const {
///         for (float& z : depth(frame)) z *= static_cast<float>(*factor);
///       }
///     };
///     TOFGRAPH_STAGE(Scale, "Multiplies the depth by a factor")
///
/// A `process` that is const may run for several frames at once; any other runs frame by frame, in order.
/// Sources return false when there is no further frame. A stage over any number of streams takes
/// `std::span<Frame>`. `prepare(Setup&)`, `finish()` and, in sources, `stop()` are optional. Errors are exceptions:
/// `ConfigError` names a parameter, anything else derived from std::exception is told with the node and the frame.
#pragma once

#include <tofgraph/plugin.h>
#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// A setting that cannot work, found in prepare; the host shows where it was written.
class ConfigError : public std::runtime_error {
 public:
  ConfigError(std::string parameter_name, const std::string& text)
      : std::runtime_error(text), parameter(std::move(parameter_name)) {}
  std::string parameter;
};

/// One frame on its way through the graph.
class Frame {
 public:
  Frame(const tofgraph_host* host, tofgraph_frame* frame) : host_(host), frame_(frame) {}

  /// Number, time stamp, integration time, ... of this frame. Sources set them.
  tofgraph_metadata& metadata() const { return *host_->metadata(frame_); }

  /// @returns a view without data when the frame has no such channel.
  tofgraph_view find(const char* channel) const {
    tofgraph_view view{};
    if (host_->read(frame_, channel, &view) != TOFGRAPH_OK) view.data = nullptr;
    return view;
  }
  /// A new buffer under the channel's name, content undefined.
  tofgraph_view write(const tofgraph_channel& channel) const {
    tofgraph_view view{};
    check(host_->write(frame_, &channel, &view), "cannot be written", channel.name);
    return view;
  }
  /// The channel for changing it in place: a private copy where others share it.
  tofgraph_view modify(const char* channel) const {
    tofgraph_view view{};
    check(host_->modify(frame_, channel, &view), "is not in the frame", channel);
    return view;
  }
  /// Hands memory of the stage to the frame without a copy; `release(owner)` is called when nobody reads it.
  void share(const tofgraph_view& view, void* owner, void (*release)(void*)) const {
    check(host_->share(frame_, &view, owner, release), "cannot be shared", view.channel);
  }
  void drop(const char* channel) const { check(host_->drop(frame_, channel), "is not in the frame", channel); }

 private:
  static void check(int status, const char* what, const char* channel) {
    if (status != TOFGRAPH_OK) throw std::runtime_error("channel " + std::string(channel) + " " + what);
  }
  const tofgraph_host* host_;
  tofgraph_frame* frame_;
};

namespace detail {
class PortBase;
class ParamBase;
}  // namespace detail

/// What every stage has: its contract and its host. Derive from Source, Filter or Sink.
class Stage {
 public:
  using Frame = tofgraph::Frame;
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  void finish() {}
  void stop() {}

  /// A remark for the user that does not end the run.
  void warn(const std::string& text) const { host->message(context, TOFGRAPH_WARNING, text.c_str()); }
  /// The provenance of what arrives here, as JSON.
  std::string provenance() const { return host->provenance(context); }
  /// True once the run is ending: a source that waits should return false.
  bool stopping() const { return host->stopping(context) != 0; }

  const tofgraph_host* host = nullptr;
  void* context = nullptr;
  std::vector<detail::PortBase*> ports;        ///< filled by the members
  std::vector<detail::ParamBase*> parameters;  ///< filled by the members
};

/// What a stage learns and says before the first frame.
class Setup {
 public:
  Setup(const Stage& stage, std::span<const tofgraph_stream* const> streams) : stage_(stage), streams_(streams) {}

  std::span<const tofgraph_stream* const> streams() const { return streams_; }
  /// The stream that arrives (of several, the first).
  const tofgraph_stream& stream() const { return *streams_.front(); }
  /// The camera of the stream; for sources, the pipeline's. @throws std::runtime_error when there is none.
  const tofgraph_camera& camera() const {
    if (stream().camera == nullptr) {
      throw std::runtime_error("needs to know the camera: write camera: NAME at the top of the pipeline");
    }
    return *stream().camera;
  }
  bool knows(std::uint64_t metadata) const { return (stream().known & metadata) == metadata; }
  /// A channel of the stream, or null.
  const tofgraph_channel* find(std::string_view name) const {
    for (const tofgraph_channel& channel : channels()) {
      if (channel.name == name) return &channel;
    }
    return nullptr;
  }
  std::span<const tofgraph_channel> channels() const { return {stream().channels, stream().channel_count}; }

  /// Announces a channel that no port declares, or an optional output.
  void provide(const tofgraph_channel& channel) const { stage_.host->provide(stage_.context, &channel); }
  void withdraw(const char* channel) const { stage_.host->withdraw(stage_.context, channel); }
  /// Another camera leaves than came: other rays, another size. Copied; rays null: made from its lens model.
  void set_camera(const tofgraph_camera& camera) const { stage_.host->set_camera(stage_.context, &camera); }
  /// For sources: the camera by its profile's name, or by the profile's text. @returns false when there is none.
  bool use_profile(const std::string& name, const std::string& text = {}) const {
    return stage_.host->use_profile(stage_.context, name.c_str(), text.empty() ? nullptr : text.c_str()) == TOFGRAPH_OK;
  }
  void set_frames(std::uint64_t frames, std::uint64_t known) const {
    stage_.host->set_frames(stage_.context, frames, known);
  }
  /// A file whose content shapes the result: its hash goes into the provenance.
  void uses_file(const std::string& path) const { stage_.host->uses_file(stage_.context, path.c_str()); }
  /// True when existing files may be replaced.
  bool overwrite() const { return stage_.host->overwrite(stage_.context) != 0; }

 private:
  const Stage& stage_;
  std::span<const tofgraph_stream* const> streams_;
};

/// The fields of a port beside its channel; see tofgraph_port. What is left out comes from the table of channels.
struct PortSpec {
  const char* text = nullptr;
  bool optional = false;
  const char* name = nullptr;  ///< default: the first channel
  const char* shape = nullptr;
  const char* unit = nullptr;
  const char* needs = "";
  const char* refuses = "";
  const char* from = "";
  const char* adds = "";
  const char* of = "";
};

/// The fields of a parameter; see tofgraph_parameter. Bounds are SI, the default is written as in a pipeline.
struct ParamSpec {
  const char* unit = "";
  const char* fallback = nullptr;
  bool required = false;
  double min = std::numeric_limits<double>::quiet_NaN();
  double max = std::numeric_limits<double>::quiet_NaN();
  const char* choices = "";
  const char* text = "";
  double off = std::numeric_limits<double>::quiet_NaN();
  double typical = std::numeric_limits<double>::quiet_NaN();
};

struct Choice : std::string {};      ///< one of the words in `choices`
struct InputFile : std::string {};   ///< absolute path of a file to read, or empty
struct OutputFile : std::string {};  ///< absolute path (or pattern) of a file to write

namespace detail {

class PortBase {
 public:
  PortBase(Stage* stage, std::uint32_t type, std::uint32_t direction, const char* channel, const PortSpec& spec)
      : first_(std::string_view(channel).substr(0, std::string_view(channel).find('|'))) {
    const ChannelInfo* known = known_channel(first_);
    const auto either = [](const char* given, const char* other) { return given != nullptr ? given : other; };
    const bool every = first_ == "*";
    port_ = {.name = either(spec.name, every ? "every" : first_.c_str()),
             .channel = channel,
             .shape = either(spec.shape, known != nullptr ? known->shape : ""),
             .unit = either(spec.unit, known != nullptr ? known->unit : ""),
             .type = type,
             .direction = direction,
             .flags = (spec.optional ? std::uint32_t{TOFGRAPH_OPTIONAL} : 0U) | (every ? std::uint32_t{TOFGRAPH_EVERY} : 0U),
             .needs = spec.needs,
             .refuses = spec.refuses,
             .from = spec.from,
             .adds = spec.adds,
             .of = spec.of,
             .text = either(spec.text, known != nullptr ? known->text : "")};
    stage->ports.push_back(this);
  }
  PortBase(const PortBase&) = delete;
  PortBase& operator=(const PortBase&) = delete;

  const tofgraph_port& port() const { return port_; }
  /// The channel that the port reads or makes; empty for an optional input that is not there. Known in prepare.
  const char* channel() const { return bound_.c_str(); }
  bool present() const { return !bound_.empty(); }
  void bind(const char* channel) { bound_ = channel != nullptr ? channel : ""; }

 protected:
  std::string first_, bound_;
  tofgraph_port port_{};
};

class ParamBase {
 public:
  ParamBase(Stage* stage, std::uint32_t kind, const char* name, const ParamSpec& spec)
      : parameter_{name,     kind,         spec.required, spec.unit, spec.fallback, spec.min,
                   spec.max, spec.choices, spec.text,     spec.off,  spec.typical} {
    stage->parameters.push_back(this);
  }
  ParamBase(const ParamBase&) = delete;
  ParamBase& operator=(const ParamBase&) = delete;
  virtual ~ParamBase() = default;
  virtual void set(const tofgraph_value& value) = 0;

  const tofgraph_parameter& parameter() const { return parameter_; }
  /// True when the user wrote the parameter, false for the default.
  bool given() const { return given_; }

 protected:
  tofgraph_parameter parameter_;
  bool given_ = false;
};

template <class T>
constexpr std::uint32_t parameter_kind() {
  if constexpr (std::is_same_v<T, bool>) return TOFGRAPH_BOOL;
  if constexpr (std::is_same_v<T, std::int64_t>) return TOFGRAPH_INTEGER;
  if constexpr (std::is_same_v<T, double>) return TOFGRAPH_NUMBER;
  if constexpr (std::is_same_v<T, std::string>) return TOFGRAPH_TEXT;
  if constexpr (std::is_same_v<T, Choice>) return TOFGRAPH_CHOICE;
  if constexpr (std::is_same_v<T, std::vector<double>>) return TOFGRAPH_NUMBERS;
  if constexpr (std::is_same_v<T, InputFile>) return TOFGRAPH_INPUT_FILE;
  if constexpr (std::is_same_v<T, OutputFile>) return TOFGRAPH_OUTPUT_FILE;
}

}  // namespace detail

/// An input port: call it with the frame to get a read-only view. T void: any element type, gives a tofgraph_view.
template <class T>
class In : public detail::PortBase {
 public:
  In(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_IN, channel, spec) {}
  /// @returns an empty view when an optional input is not there.
  auto operator()(const Frame& frame) const {
    const tofgraph_view view = present() ? frame.find(channel()) : tofgraph_view{};
    if constexpr (std::is_void_v<T>)
      return view;
    else
      return view.data != nullptr ? Array<const T>(view) : Array<const T>();
  }
};

/// An output port: call it with the frame and the extents to get a new buffer.
template <class T>
class Out : public detail::PortBase {
 public:
  Out(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_OUT, channel, spec) {
    bound_ = (port_.flags & TOFGRAPH_OPTIONAL) == 0 ? first_ : "";
  }
  Array<T> operator()(const Frame& frame, std::size_t rows, std::size_t columns, std::size_t depth = 0) const {
    return Array<T>(frame.write({.name = channel(),
                                 .type = element_type<T>(),
                                 .rank = depth != 0 ? 3U : 2U,
                                 .extent = {rows, columns, depth, 0},
                                 .unit = port_.unit,
                                 .of = port_.of,
                                 .applied = "",
                                 .from = ""}));
  }
  /// In prepare: announces an optional output; of: for sigma, the channel it belongs to.
  void provide(const Setup& setup, const char* of = nullptr) {
    bound_ = first_;
    setup.provide({.name = channel(),
                   .type = element_type<T>(),
                   .rank = 0,
                   .extent = {},
                   .unit = port_.unit,
                   .of = of != nullptr ? of : port_.of,
                   .applied = "",
                   .from = port_.from});
  }
};

/// A port that changes a channel in place.
template <class T>
class InOut : public detail::PortBase {
 public:
  InOut(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_INOUT, channel, spec) {}
  /// @returns an empty view when an optional channel is not there.
  Array<T> operator()(const Frame& frame) const { return present() ? Array<T>(frame.modify(channel())) : Array<T>(); }
  Array<const T> read(const Frame& frame) const { return Array<const T>(frame.find(channel())); }
  /// In prepare: an optional image that is not there is made by this stage, beginning with zeros.
  void provide(const Setup& setup) {
    if (present()) return;
    made_ = true;
    bound_ = first_;
    setup.provide({.name = channel(), .type = element_type<T>(), .rank = 0, .extent = {}, .unit = port_.unit,
                   .of = port_.of, .applied = "", .from = port_.from});
  }
  /// For an image that provide() may have to make.
  Array<T> operator()(const Frame& frame, std::size_t rows, std::size_t columns) const {
    if (!made_) return (*this)(frame);
    const Array<T> image(frame.write({.name = channel(), .type = element_type<T>(), .rank = 2,
                                      .extent = {rows, columns, 0, 0}, .unit = port_.unit, .of = port_.of,
                                      .applied = "", .from = ""}));
    std::fill(image.begin(), image.end(), T{});
    return image;
  }

 private:
  bool made_ = false;
};

/// A parameter; * gives its value, numbers in SI.
template <class T>
class Param : public detail::ParamBase {
 public:
  Param(Stage* stage, const char* name, const ParamSpec& spec)
      : ParamBase(stage, detail::parameter_kind<T>(), name, spec) {}
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }
  /// For a number that may be a word ("auto"): the word, or empty.
  const std::string& word() const { return word_; }

  void set(const tofgraph_value& value) override {
    given_ = value.given != 0;
    word_ = value.text;
    if constexpr (std::is_same_v<T, bool>)
      value_ = value.integer != 0;
    else if constexpr (std::is_same_v<T, std::int64_t>)
      value_ = value.integer;
    else if constexpr (std::is_same_v<T, double>)
      value_ = value.number;
    else if constexpr (std::is_same_v<T, std::vector<double>>)
      value_.assign(value.numbers, value.numbers + value.count);
    else
      value_ = T{value.text};
  }

 private:
  T value_{};
  std::string word_;
};

struct Source : Stage {
  static constexpr const char* kind = "source";
  template <class T>
  using Out = tofgraph::Out<T>;
  template <class T>
  using Param = tofgraph::Param<T>;
  void prepare(Setup&) {}
};
struct Filter : Stage {
  static constexpr const char* kind = "filter";
  template <class T>
  using In = tofgraph::In<T>;
  template <class T>
  using Out = tofgraph::Out<T>;
  template <class T>
  using InOut = tofgraph::InOut<T>;
  template <class T>
  using Param = tofgraph::Param<T>;
  void prepare(Setup&) {}
};
struct Sink : Filter {
  static constexpr const char* kind = "sink";
};

}  // namespace tofgraph

#include <tofgraph/detail/glue.hpp>  // IWYU pragma: export
