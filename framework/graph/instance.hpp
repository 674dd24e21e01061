// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Running instance of a plugin, stage or effect: created, prepared and served by one host. The plugin's calls to the
/// host arrive here (instance_host_calls.cpp).
#pragma once

#include "graph/frame.hpp"
#include "graph/plugin.hpp"
#include "graph/stream.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::graph {

class KnownStages;

/// The run of a graph as seen by its stages. [any thread]
class RunControl {
 public:
  RunControl() = default;
  RunControl(const RunControl&) = delete;
  RunControl& operator=(const RunControl&) = delete;
  virtual ~RunControl() = default;
  virtual nlohmann::json state() const = 0;
  /// See tofgraph_host::change_parameter. @throws std::runtime_error the reason
  virtual nlohmann::json change(const std::string& node, const std::string& parameter, const std::string& value) = 0;
};

/// State shared by all instances of a run.
struct Host {
  bool overwrite = false;
  std::atomic<bool> stopping{false};
  std::atomic<bool> hashing_stopped{false};  ///< the run failed: the hashes of long inputs are not needed
  bool wants_hashes() const { return !stopping.load() && !hashing_stopped.load(); }
  std::function<void(const std::string& node, const std::string& text, bool warning)> message;
  std::string version;
  std::string plugin_path;                      ///< folders separated by colons
  const KnownStages* known_stages = nullptr;    ///< for advice while a graph is checked
  std::vector<std::filesystem::path> inputs{};  ///< files that the graph reads; no output may overwrite them

  std::shared_mutex control_mutex{};  ///< guards `run`: shared for a request, exclusive while it is set or cleared
  RunControl* control = nullptr;
};

/// File that influenced a result.
struct UsedFile {
  explicit UsedFile(std::string used) : path(std::move(used)), hash(std::make_shared<io::FileHash>(path)) {}
  std::string path;
  std::shared_ptr<const io::FileHash> hash;
};

/// Failure of a call, as reported by the plugin.
struct Failure {
  std::string parameter, text;
  bool defect = false;  ///< the host detected a violation of the plugin interface
  /// The message; names the plugin's file if removing the plugin is all that a user can do.
  std::string message(const Plugin& plugin) const;
};
/// Failure of this thread's running call.
Failure& last_failure();
/// For the catch clause of a host call, which must not throw: records the exception as the running call's failure.
void keep_failure() noexcept;

/// Changes that a stage makes to its stream in prepare.
struct OutputStream {
  Stream stream;
  io::CameraPtr own_camera;             ///< if this node changed it
  tofgraph_stream* arriving = nullptr;  ///< input of a source, with its camera once chosen
};

class Instance {
 public:
  /// @param name of the node or of the effect
  Instance(const Plugin& plugin, std::string name, Host& host);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  const Plugin& plugin() const { return plugin_; }
  const std::string& name() const { return name_; }
  void* self() const { return self_; }

  /// @param values in the order of the descriptor's parameters. @returns the error, if any
  std::optional<Failure> create(const tofgraph_value* values);
  /// @param index of the node @param output_stream null for an effect, which has no stream
  std::optional<Failure> prepare(std::span<const tofgraph_stream* const> streams, std::size_t index,
                                 OutputStream* output_stream);
  /// @returns the call's status. @throws std::runtime_error the error
  int process(std::span<tofgraph_frame* const> frames);
  void finish();  ///< @throws std::runtime_error
  /// Changes live parameters between two frames. @returns the reason if the old values are kept
  std::optional<Failure> change(const tofgraph_value* values);
  void stop() noexcept;

  /// Output files of a stage, indexed by parameter.
  void set_outputs(std::vector<io::OutputPattern> outputs) { outputs_ = std::move(outputs); }
  void set_overwrite(bool allowed) { overwrite_ = allowed; }
  /// @param make called at the stage's first request, after prepare, because hashing long files takes time
  void set_provenance(std::function<std::string()> make) { make_provenance_ = std::move(make); }
  /// Returns whether the stage called for the provenance in prepare, which announces a request at the end of the run.
  bool wants_provenance() const { return wants_provenance_; }
  const std::vector<UsedFile>& files() const { return files_; }
  void add_file(const std::string& path);
  /// Warnings of create and prepare, reported at the node's position in the pipeline.
  const std::vector<std::string>& warnings() const { return warnings_; }
  void add_note(std::string text) { notes_.push_back(std::move(text)); }
  /// Notes of the instance about itself, for `explain`.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  friend struct HostCalls;

  /// @returns whether this is the first request for a file that is written once per run
  bool claim(std::size_t parameter);

  const Plugin& plugin_;
  std::string name_;
  Host& host_;
  void* self_ = nullptr;
  bool starting_ = true;  ///< create and prepare have not finished
  bool overwrite_ = false;
  std::size_t index_ = 0;
  OutputStream* output_stream_ = nullptr;  ///< during prepare of a stage
  std::vector<std::string> warnings_, notes_;
  std::vector<UsedFile> files_;
  std::vector<io::OutputPattern> outputs_;
  std::mutex claims_mutex_;
  std::set<std::size_t> claims_;
  std::function<std::string()> make_provenance_;
  bool wants_provenance_ = false;
  std::once_flag provenance_made_;
  std::string provenance_;
};

/// Table of services, the same for every plugin.
const tofgraph_host& host_table();

}  // namespace tofgraph::graph
