// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A stage out of a graph: it gets the channels that it declares, filled with values of a kind.
#pragma once

#include "conformance/check.hpp"
#include "graph/node.hpp"

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::conformance {

/// Error of a stage that says itself what it does not take.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws the failure of a stage with what was said of it. @param defect the host found a bug in the plugin
/// @throws Refusal, or Violation for a defect
[[noreturn]] void refuse(const std::string& text, bool defect = false);

/// Values of the frames. Invalid pixels keep the rule of lengths and flags.
enum class Content { ordinary, invalid, denormal, huge };

using Settings = std::map<std::string, std::string>;

struct Conditions {
  std::uint32_t rows = 48, columns = 64;
  bool sizes_known = true;  ///< false: no camera, and the channels' extents come with the frame
  bool watched = true;      ///< as by run --validate
  Settings settings = {};   ///< beside those of the subject
};

/// Values for the parameters of a plugin: those given, and of required ones the example in their text.
/// @throws NotApplicable one is required and has no example
Settings settings_of(const Subject& subject, const Settings& given = {});

/// @throws Refusal what is wrong with them
graph::ParameterValues values_of(const graph::Plugin& plugin, const Settings& settings);

/// A camera of this size, in all else as the profile camcube2 describes one.
io::CameraPtr camera_of(std::uint32_t rows, std::uint32_t columns);

class Trial {
 public:
  /// Makes and prepares the stage. @throws Refusal
  explicit Trial(const Subject& subject, const Conditions& conditions = {});
  /// The same of a plugin that stands for the subject's.
  Trial(const Subject& subject, const graph::Plugin& plugin, const Conditions& conditions);
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;
  ~Trial();

  bool is_source() const { return node_->is_source(); }
  bool stateless() const { return node_->stateless(); }

  /// A frame as it arrives; its buffers are shared with the next call for the same number.
  tofgraph_frame frame(std::uint64_t number, Content content = Content::ordinary);
  /// Runs the stage on it. @returns whether it leaves. @throws Refusal, graph::BrokenPromise. [stateless: any thread]
  bool process(tofgraph_frame& frame) const;
  /// The end of the run. @throws Refusal
  void finish() const;
  const graph::Stream& output() const { return node_->output(); }

  /// Hash of the content of a frame.
  static std::size_t digest(const tofgraph_frame& frame);
  /// The digests of frames 0 .. count - 1; of one that does not leave 0.
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

/// Calls a check that a refusal in words passes. @returns the refusal, or nothing
template <class Call> std::string or_refuses(Call&& call) {
  try {
    call();
    return {};
  } catch (const Refusal& refusal) {
    return std::string("refused: ") + refusal.what();
  }
}

/// The subject's stage; where it refuses its defaults there is nothing to look at.
/// @throws NotApplicable
std::unique_ptr<Trial> ready(const Subject& subject, const Conditions& conditions = {});

}  // namespace tofgraph::conformance
