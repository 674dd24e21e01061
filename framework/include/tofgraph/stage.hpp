// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stages: a class whose members are its contract, plus one `process`.
///
///     struct Scale final : tofgraph::Filter {
///       InOut<float> depth{this, "depth", {.text = "what is scaled"}};
///       Param<double> factor{this, "factor", {.default_value = "1.01", .min = 0.5, .max = 2, .text = "multiplier"}};
///       void process(Frame& frame) const {
///         for (float& z : depth(frame)) z *= static_cast<float>(*factor);
///       }
///     };
///     TOFGRAPH_STAGE(Scale, "Multiplies the depth by a factor")
///
/// A `process` that is const may run for several frames at once; any other runs frame by frame, in order. Sources
/// return false when there is no further frame, filters to drop this one. A stage over any number of streams takes
/// `std::span<Frame>`. `prepare(Setup&)`, `finish()` and, in sources, `stop()` are optional. Errors are exceptions:
/// `ConfigError` names a parameter, anything else derived from std::exception is reported with the node and the
/// frame.
#pragma once

#include <tofgraph/plugin.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/frame.hpp>

#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// Invalid parameter value found in prepare; the host shows where it was written.
class ConfigError : public std::runtime_error {
 public:
  ConfigError(std::string parameter_name, const std::string& text)
      : std::runtime_error(text), parameter(std::move(parameter_name)) {}
  std::string parameter;
};

class Setup;
namespace detail {
class PortBase;
class ParamBase;
}  // namespace detail
template <class T> class In;
template <class T> class Out;
template <class T> class InOut;
template <class T> class Param;

/// Base of all stages: contract and host. Derive from Source, Filter or Sink.
class Stage {
 public:
  using Frame = tofgraph::Frame;
  template <class T> using In = tofgraph::In<T>;
  template <class T> using Out = tofgraph::Out<T>;
  template <class T> using InOut = tofgraph::InOut<T>;
  template <class T> using Param = tofgraph::Param<T>;
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  void prepare(Setup&) {}
  void finish() {}
  void stop() {}
  /// Called between two frames after parameters declared `.live` changed. A ConfigError refuses the change: the stage
  /// must then be in its previous state; the host restores the parameters.
  void parameters_changed() {}

  /// Reports a warning that does not end the run.
  void warn(const std::string& text) const { host->message(context, TOFGRAPH_MESSAGE_WARNING, text.c_str()); }
  /// Adds a note on this node for `explain`; in prepare.
  void note(const std::string& text) const { host->message(context, TOFGRAPH_MESSAGE_INFO, text.c_str()); }
  /// Provenance of the input, as JSON: call in finish(), and also in prepare() so that it is ready in time.
  std::string provenance() const { return host->provenance(context); }
  /// True once the run is ending: a waiting source should return false.
  bool stopping() const { return host->stopping(context) != 0; }

  const tofgraph_host* host = nullptr;
  void* context = nullptr;
  std::vector<detail::PortBase*> ports;        ///< filled by the port members
  std::vector<detail::ParamBase*> parameters;  ///< filled by the parameter members
};

/// Input and declarations of a stage before the first frame.
class Setup {
 public:
  Setup(const Stage& stage, std::span<const tofgraph_stream* const> streams)
      : host_(stage.host), context_(stage.context), streams_(streams) {}

  std::span<const tofgraph_stream* const> streams() const { return streams_; }
  /// Input stream (the first of several).
  const tofgraph_stream& stream() const { return *streams_.front(); }
  /// Camera of the stream; for sources, the pipeline's. @throws std::runtime_error if there is none.
  const tofgraph_camera& camera() const {
    if (stream().camera != nullptr) return *stream().camera;
    throw std::runtime_error(
        "needs to know the camera: --camera NAME, or camera: NAME at the top of the pipeline file");
  }
  bool knows(std::uint64_t metadata) const { return (stream().known & metadata) == metadata; }
  /// Channel of the stream, or null.
  const tofgraph_channel* find(std::string_view name) const {
    for (const tofgraph_channel& channel : channels())
      if (channel.name == name) return &channel;
    return nullptr;
  }
  Strided<const tofgraph_channel> channels() const {
    return {stream().channels, stream().channel_size, stream().channel_count};
  }
  /// Exposures of the raw images of a frame, in order.
  Strided<const tofgraph_exposure> exposures() const {
    return {stream().exposures, stream().exposure_size, stream().exposure_count};
  }

  /// Announces a channel that no port declares, or an optional output.
  void provide(tofgraph_channel channel) const {
    channel.size = sizeof channel;
    host_->provide(context_, &channel);
  }
  void withdraw(const char* channel) const { host_->withdraw(context_, channel); }
  /// Sets the camera of the output if its rays or size change. Copied; rays null: computed from its lens model.
  void set_camera(tofgraph_camera camera) const {
    camera.size = sizeof camera;  // a copied struct is valid up to the size known to this header
    host_->set_camera(context_, &camera);
  }
  /// For sources: sets the camera by its profile's name or text. @returns false if there is none.
  bool use_profile(const std::string& name, const std::string& text = {}) const {
    return host_->use_profile(context_, name.c_str(), text.empty() ? nullptr : text.c_str()) == TOFGRAPH_STATUS_OK;
  }
  void set_frames(std::uint64_t frames, std::uint64_t known) const { host_->set_frames(context_, frames, known); }
  /// For sources: sets the exposures of the frames if they are not the camera's.
  void set_exposures(std::span<const tofgraph_exposure> exposures) const {
    host_->set_exposures(context_, exposures.data(), sizeof(tofgraph_exposure), exposures.size());
  }
  /// Adds the hash of a file that influences the result to the provenance. The host itself adds files and images that
  /// are parameters.
  void uses_file(const std::string& path) const { host_->uses_file(context_, path.c_str()); }
  /// True if existing files may be replaced.
  bool overwrite() const { return host_->overwrite(context_) != 0; }

 private:
  const tofgraph_host* host_;
  void* context_;
  std::span<const tofgraph_stream* const> streams_;
};

struct Source : Stage {
  static constexpr const char* kind = "source";
};
struct Filter : Stage {
  static constexpr const char* kind = "filter";
};
struct Sink : Stage {
  static constexpr const char* kind = "sink";
};
/// Component of the simulator's physics: see effect.hpp.
struct Effect : Stage {
  static constexpr const char* kind = "effect";
};

}  // namespace tofgraph

#include <tofgraph/ports.hpp>  // IWYU pragma: export
