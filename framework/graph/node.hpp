// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A node: one stage of the graph, with its contract checked on both sides.
#pragma once

#include "config/document.hpp"
#include "graph/bad_pixels.hpp"
#include "graph/frame.hpp"
#include "graph/instance.hpp"
#include "graph/parameters.hpp"
#include "graph/stream.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::graph {

class Node {
 public:
  Node(std::size_t index, std::string name, config::Position at, const Plugin& plugin, ParameterValues values,
       Host& host);

  /// Creates the stage and queries its outputs. Errors go to the diagnostics, with their position.
  bool create(config::Diagnostics& diagnostics);
  bool prepare(const std::vector<const Stream*>& inputs, const std::vector<std::string>& input_names,
               config::Diagnostics& diagnostics);

  /// True if one of the errors is a bug in the plugin, not a value that it refuses.
  bool has_defect() const { return defect_; }

  /// Runs the stage on one frame. @returns false if there is no output: a source has ended. @throws std::runtime_error
  /// the error, including a frame that differs from what was announced.
  bool process(tofgraph_frame* const* frames, std::size_t count);
  /// Changes live parameters while no frame is in this node. @returns the reason if the old values are kept
  std::optional<Failure> change(ParameterValues values);
  void finish() { instance_.finish(); }  ///< @throws std::runtime_error
  void stop() { instance_.stop(); }

  bool is_source() const { return kind_is("source"); }
  bool is_sink() const { return kind_is("sink"); }
  bool stateless() const { return (stage().flags & TOFGRAPH_STAGE_STATELESS) != 0; }
  bool many_inputs() const { return (stage().flags & TOFGRAPH_STAGE_MANY_INPUTS) != 0; }

  const std::size_t index;
  const std::string name;
  const config::Position at;
  const Plugin& stage() const { return instance_.plugin(); }
  const ParameterValues& values() const { return values_; }
  /// Parameters at the start of the run, as written, and later changes with the first frame of each.
  const nlohmann::json& first_parameters() const { return changes_.empty() ? values_.shown() : first_parameters_; }
  const nlohmann::json& changes() const { return changes_; }
  void add_change(nlohmann::json change) { changes_.push_back(std::move(change)); }
  const Stream& output() const { return output_stream_.stream; }
  const std::vector<UsedFile>& files() const { return instance_.files(); }
  const std::vector<std::string>& notes() const { return instance_.notes(); }  ///< stage's, for `explain`
  /// Files of each parameter that names some, indexed by parameter; empty text: none.
  const std::vector<io::OutputPattern>& outputs() const { return outputs_; }
  void set_overwrite(bool allowed);
  /// Validates each call of process() from now on: it fails if the stage violates the contract for a frame.
  void set_validating() { validating_ = true; }
  /// Ends this source after a number of frames. One more frame is requested from the stage and discarded.
  void set_max_frames(std::uint64_t count) { max_frames_ = count; }
  /// True once the stage has produced a frame beyond the maximum.
  bool exceeded_max_frames() const { return exceeded_max_frames_; }
  bool wants_provenance() const { return instance_.wants_provenance(); }
  void set_provenance(std::function<std::string()> make) { instance_.set_provenance(std::move(make)); }

 private:
  struct BorderStream;

  bool kind_is(std::string_view kind) const { return kind == stage().kind; }
  bool tell(const std::optional<Failure>& failure, config::Diagnostics& diagnostics);
  bool bind(const Stream& stream, std::vector<const Channel*>& bound, config::Diagnostics& diagnostics) const;
  bool check_input(const Stream& stream, const tofgraph_port& port, const Channel& channel,
                   config::Diagnostics& diagnostics) const;
  std::string remedy(const std::vector<std::string>& channels, const Stream& stream) const;
  std::string instead_of(const std::string& word, const Channel& channel, const Stream& stream) const;
  void complete_history();
  void announce_outputs(const std::vector<const Channel*>& bound);
  bool check_outputs(const Stream& input, const std::vector<const Channel*>& bound,
                     config::Diagnostics& diagnostics) const;
  bool outputs_avoid_inputs(config::Diagnostics& diagnostics);
  bool choose_files(std::uint64_t frames, config::Diagnostics& diagnostics);
  std::vector<std::string> names_made() const;
  std::string without_recorded(const Stream& stream, const std::vector<std::string>& unwanted) const;
  bool check_exposures(config::Diagnostics& diagnostics) const;
  void size_images();
  void announce_rays();
  void announce_bad_pixels(config::Diagnostics& diagnostics);
  int call_process(std::span<tofgraph_frame* const> frames);
  void verify(const tofgraph_frame& frame) const;

  ParameterValues values_;
  nlohmann::json first_parameters_, changes_ = nlohmann::json::array();
  Instance instance_;
  Host& host_;
  OutputStream output_stream_;
  std::vector<io::OutputPattern> outputs_;
  BufferRef rays_;                    ///< rays of the outgoing camera, if this node chose it
  BadPixels bad_pixels_;              ///< camera's, if this node is a source
  std::vector<std::string> aliases_;  ///< channels for a named port only, not passed on
  bool overwrite_, validating_ = false, defect_ = false, exceeded_max_frames_ = false;
  std::optional<std::uint64_t> max_frames_;  ///< of a source; none: unlimited
  std::uint64_t frames_made_ = 0;            ///< by a source with a maximum
};

}  // namespace tofgraph::graph
