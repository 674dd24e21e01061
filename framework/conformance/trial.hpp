// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs a stage outside a graph, with the channels that it declares, filled with synthetic values.
#pragma once

#include "conformance/check.hpp"
#include "graph/node.hpp"

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::conformance {

/// Error in which a stage itself reports that it does not accept its input.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws the failure of a stage with its message. @param defect the host found a bug in the plugin
/// @throws Refusal, or Violation for a defect
[[noreturn]] void refuse(const std::string& text, bool defect = false);

/// Values of the frames. Lengths of invalid pixels are NaN and flagged.
enum class Content { ordinary, invalid, denormal, huge };

using Settings = std::map<std::string, std::string>;

struct Conditions {
  std::uint32_t rows = 48, columns = 64;
  bool sizes_known = true;  ///< false: no camera, and the channels' extents are those of the frame
  bool watched = true;      ///< as with run --validate
  Settings settings = {};   ///< in addition to those of the subject
};

/// Values for the parameters of a plugin: the given ones, and for required ones the example in their description.
/// @throws NotApplicable if a required parameter has no example
Settings settings_of(const Subject& subject, const Settings& given = {});

/// @throws Refusal if they are invalid
graph::ParameterValues values_of(const graph::Plugin& plugin, const Settings& settings);

/// Camera of this size, otherwise as in the profile camcube2.
io::CameraPtr camera_of(std::uint32_t rows, std::uint32_t columns);

class Trial {
 public:
  /// Creates and prepares the stage. @throws Refusal
  explicit Trial(const Subject& subject, const Conditions& conditions = {});
  /// As above, for a plugin that replaces the subject's.
  Trial(const Subject& subject, const graph::Plugin& plugin, const Conditions& conditions);
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial();

  bool is_source() const { return node_->is_source(); }
  bool stateless() const { return node_->stateless(); }

  /// Input frame; its buffers are shared with the next call for the same number.
  tofgraph_frame frame(std::uint64_t number, Content content = Content::ordinary);
  /// Runs the stage. @returns whether it passes the frame on. @throws Refusal, BrokenPromise. [stateless: any thread]
  bool process(tofgraph_frame& frame) const;
  /// Ends the run. @throws Refusal
  void finish() const;
  const graph::Stream& output() const { return node_->output(); }

  /// Hash of the content of a frame.
  static std::size_t digest(const tofgraph_frame& frame);
  /// Digests of frames 0 .. count - 1; 0 for a frame that is dropped.
  std::vector<std::size_t> digests(std::uint64_t count, Content content = Content::ordinary);

 private:
  void add_channels(const Conditions& conditions);
  void add_channel(const tofgraph_port& port, const Conditions& conditions);
  void prepare();

  std::uint64_t seed_;
  std::uint32_t rows_, columns_;
  graph::Host host_;
  std::shared_ptr<graph::BufferPool> pool_ = std::make_shared<graph::BufferPool>();
  graph::Stream input_;
  std::map<std::pair<std::uint64_t, Content>, tofgraph_frame> frames_;
  std::unique_ptr<graph::Node> node_;
};

/// Calls a check that accepts a refusal with a message. @returns the refusal, or nothing
template <class Call> std::string or_refuses(Call&& call) {
  try {
    call();
    return {};
  } catch (const Refusal& refusal) {
    return std::string("refused: ") + refusal.what();
  }
}

/// Stage of the subject, created and prepared.
/// @throws NotApplicable if the stage refuses its defaults
std::unique_ptr<Trial> ready(const Subject& subject, const Conditions& conditions = {});

}  // namespace tofgraph::conformance
