// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The members that define a stage's contract: ports and parameters. Included by stage.hpp.
#pragma once

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <tuple>

namespace tofgraph {

/// Fields of a port except its channel; see tofgraph_port. Defaults come from the table of channels.
struct PortSpec {
  const char *name = nullptr, *shape = nullptr, *unit = nullptr;  ///< name: default: the first channel
  bool optional = false;
  const char* text = nullptr;
  const char *needs = "", *refuses = "", *from = "", *adds = "", *of = "";
};

/// Fields of a parameter; see tofgraph_parameter. Bounds are in SI, the default is written as in a pipeline.
struct ParamSpec {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const char *unit = "", *default_value = nullptr;
  bool required = false;
  double min = none, max = none;
  const char *choices = "", *text = "";
  double off = none, typical = none;
  bool in_place = false;  ///< for an InputFile: the content may be written instead; the value is then "{..}"
  bool nested = false;    ///< for an effect: a refinement, varied by a search only if the data require it
  bool live = false;      ///< may change between two frames of a run; parameters_changed() is then called
};

struct Choice : std::string {};       ///< a word of `choices`
struct InputFile : std::string {};    ///< absolute path of an input file, or empty
struct InputFolder : std::string {};  ///< absolute path of a folder, or empty
struct OutputFile : std::string {};   ///< absolute path of the one output file of a run, or empty
struct FrameFiles : std::string {};   ///< absolute pattern of the output files, one per frame, or empty
/// Pixel values in row-major order, in SI; empty if none was given. In prepare it has the camera's size.
struct Image {
  const double* data = nullptr;
  std::size_t rows = 0, columns = 0;
  bool empty() const { return data == nullptr; }
};

namespace detail {

/// Aborts a call whose error the host knows already.
struct AlreadyReported {};

class PortBase {
 public:
  PortBase(Stage* stage, std::uint32_t type, std::uint32_t direction, const char* channel, const PortSpec& spec)
      : first_(std::string_view(channel).substr(0, std::string_view(channel).find('|'))) {
    const bool every = first_ == "*";
    const ChannelInfo unknown{every ? "every" : first_.c_str(), "", TOFGRAPH_TYPE_ANY, "", ""};
    const ChannelInfo& known = known_channel(first_) != nullptr ? *known_channel(first_) : unknown;
    const auto either = [](const char* given, const char* other) { return given != nullptr ? given : other; };
    const std::uint32_t flags =
        (spec.optional ? TOFGRAPH_PORT_OPTIONAL + 0U : 0U) | (every ? TOFGRAPH_PORT_EVERY + 0U : 0U);
    // clang-format off
    port_ = {either(spec.name, known.name), channel, either(spec.shape, known.shape), either(spec.unit, known.unit), type,
             direction, flags, 0, spec.needs, spec.refuses, spec.from, spec.adds, spec.of, either(spec.text, known.text)};
    // clang-format on
    stage->ports.push_back(this);
  }
  const tofgraph_port& port() const { return port_; }
  /// Channel that the port reads or writes; empty for a missing optional input. Known in prepare.
  const char* channel() const { return bound_.c_str(); }
  bool present() const { return !bound_.empty(); }
  void bind(const char* channel) { bound_ = channel != nullptr ? channel : ""; }

 protected:
  /// Channel description for the host; rank 0: with the extents declared by the port.
  tofgraph_channel made(std::uint32_t rank, std::size_t rows, std::size_t columns, std::size_t depth) const {
    return {sizeof(tofgraph_channel),  port_.type, rank,     0,  channel(),
            {rows, columns, depth, 0}, port_.unit, port_.of, "", port_.from};
  }
  void announce(const Setup& setup, const char* of) {
    bound_ = first_;
    tofgraph_channel channel = made(0, 0, 0, 0);
    if (of != nullptr) channel.of = of;
    setup.provide(channel);
  }
  std::string first_, bound_;
  tofgraph_port port_{};
};

class ParamBase {
 public:
  ParamBase(Stage* stage, std::uint32_t kind, const char* name, const ParamSpec& spec)
      : parameter_{name,
                   kind,
                   (spec.required ? TOFGRAPH_PARAMETER_REQUIRED + 0U : 0U) |
                       (spec.in_place ? TOFGRAPH_PARAMETER_IN_PLACE + 0U : 0U) |
                       (spec.nested ? TOFGRAPH_PARAMETER_NESTED + 0U : 0U) |
                       (spec.live ? TOFGRAPH_PARAMETER_LIVE + 0U : 0U),
                   spec.unit,
                   spec.default_value,
                   spec.min,
                   spec.max,
                   spec.choices,
                   spec.text,
                   spec.off,
                   spec.typical},
        stage_(stage) {
    stage->parameters.push_back(this);
  }
  virtual ~ParamBase() = default;
  virtual void set(const tofgraph_value& value) = 0;
  virtual void keep() = 0;     ///< saves the value
  virtual void restore() = 0;  ///< restores the saved value

  const tofgraph_parameter& parameter() const { return parameter_; }
  /// True if the user set the parameter, false for the default.
  bool given() const { return given_; }

 protected:
  std::string create(const char* companion, std::uint64_t frame) const {
    const char* path = nullptr;
    if (stage_->host->output(stage_->context, parameter_.name, companion, frame, &path) != TOFGRAPH_STATUS_OK)
      throw AlreadyReported();
    return path;
  }
  tofgraph_parameter parameter_;
  Stage* stage_;
  bool given_ = false;
};

/// Kinds of the plugin interface, in their order from 1.
using Kinds = std::tuple<bool, std::int64_t, double, std::string, Choice, std::vector<double>, InputFile, OutputFile,
                         FrameFiles, InputFolder, Image>;
template <class T, class... Types> constexpr std::uint32_t kind_among(const std::tuple<Types...>*) {
  std::uint32_t kind = 0;
  const bool known = ((++kind, std::is_same_v<T, Types>) || ...);
  return known ? kind : kind + 1;
}

}  // namespace detail

/// Input port: call it with the frame to get a read-only view. T void: any element type, returns a tofgraph_view.
template <class T> class In : public detail::PortBase {
 public:
  In(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_DIRECTION_IN, channel, spec) {}
  /// @returns an empty view if an optional input is missing.
  auto operator()(const Frame& frame) const {
    const tofgraph_view view = present() ? frame.find(channel()) : empty_view();
    using View = std::conditional_t<std::is_void_v<T>, tofgraph_view, Array<const T>>;
    return view.data != nullptr ? View(view) : View{};
  }
};

/// Output port: call it with the frame and the extents to get a new buffer.
template <class T> class Out : public detail::PortBase {
 public:
  Out(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_DIRECTION_OUT, channel, spec) {
    bound_ = (port_.flags & TOFGRAPH_PORT_OPTIONAL) == 0 ? first_ : "";
  }
  Array<T> operator()(const Frame& frame, std::size_t rows, std::size_t columns, std::size_t depth = 0) const {
    return Array<T>(frame.write(made(depth != 0 ? 3 : 2, rows, columns, depth)));
  }
  /// In prepare: announces an optional output; of: for sigma, the channel it belongs to.
  void provide(const Setup& setup, const char* of = nullptr) { announce(setup, of); }
};

/// Port that changes a channel in place.
template <class T> class InOut : public detail::PortBase {
 public:
  InOut(Stage* stage, const char* channel, const PortSpec& spec = {})
      : PortBase(stage, element_type<T>(), TOFGRAPH_DIRECTION_INOUT, channel, spec) {}
  /// @returns an empty view if an optional channel is missing.
  Array<T> operator()(const Frame& frame) const { return present() ? Array<T>(frame.modify(channel())) : Array<T>(); }
  Array<const T> read(const Frame& frame) const { return Array<const T>(frame.find(channel())); }
  /// In prepare: lets this stage create an optional image if it is missing, initialised with zeros.
  void provide(const Setup& setup, const char* of = nullptr) {
    made_here_ = !present();
    if (made_here_) announce(setup, of);
  }
  /// Access to an image that provide() may have to create.
  Array<T> operator()(const Frame& frame, std::size_t rows, std::size_t columns) const {
    if (!made_here_) return (*this)(frame);
    const Array<T> image(frame.write(made(2, rows, columns, 0)));
    std::fill(image.begin(), image.end(), T{});
    return image;
  }
  /// True if the channel is missing in the input and created by this stage.
  bool made_here() const { return made_here_; }

 private:
  bool made_here_ = false;
};

/// Parameter; operator* returns its value, numbers in SI. An optional parameter without a default is NaN, 0 or empty
/// unless the user set it: see given().
template <class T> class Param : public detail::ParamBase {
  static_assert(
      detail::kind_among<T>(static_cast<detail::Kinds*>(nullptr)) <= std::tuple_size_v<detail::Kinds>,
      "Param takes bool, std::int64_t, double, std::string, std::vector<double>, Choice, Image, files, folders");

 public:
  Param(Stage* stage, const char* name, const ParamSpec& spec)
      : ParamBase(stage, detail::kind_among<T>(static_cast<detail::Kinds*>(nullptr)), name, spec) {}
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }
  /// For a number that may be a word ("auto"): the word, or empty. For a number with several units: its unit.
  const std::string& keyword() const { return keyword_; }

  /// Creates a file under a temporary name, to be opened for writing. It gets its own name when `process` (`finish`)
  /// has returned, and is removed after an error. @param companion null, or one of `choices`: a companion file
  std::string create(const char* companion = nullptr) const requires std::is_same_v<T, OutputFile> {
    return ParamBase::create(companion, 0);
  }
  std::string create(const Frame& frame) const requires std::is_same_v<T, FrameFiles> {
    return ParamBase::create(nullptr, frame.metadata().number);
  }
  std::string create(const char* companion) const requires std::is_same_v<T, FrameFiles> {
    return ParamBase::create(companion, 0);
  }

  void keep() override { kept_ = {value_, keyword_, given_}; }
  void restore() override { std::tie(value_, keyword_, given_) = kept_; }
  void set(const tofgraph_value& value) override {
    given_ = value.given != 0;
    keyword_ = value.text;
    if constexpr (std::is_integral_v<T>)
      value_ = static_cast<T>(value.integer);
    else if constexpr (std::is_same_v<T, double>)
      value_ = value.number;
    else if constexpr (std::is_base_of_v<std::string, T>)
      value_ = T{value.text};
    else if constexpr (std::is_same_v<T, Image>)
      value_ = value.image == nullptr ? Image{}
                                      : Image{static_cast<const double*>(value.image->data), value.image->extent[0],
                                              value.image->extent[1]};
    else
      value_.assign(value.numbers, value.numbers + value.count);
  }

 private:
  T value_{};
  std::string keyword_;
  std::tuple<T, std::string, bool> kept_;
};

}  // namespace tofgraph

#include <tofgraph/detail/glue.hpp>  // IWYU pragma: export
