// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A plugin at work, stage or effect: made, prepared and served by one host. What a plugin asks of the host over the
/// border arrives here (instance_host_calls.cpp).
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

/// The run of a graph as its stages may ask for it. [any thread]
class RunControl {
 public:
  RunControl() = default;
  RunControl(const RunControl&) = delete;
  RunControl& operator=(const RunControl&) = delete;
  virtual ~RunControl() = default;
  virtual nlohmann::json state() const = 0;
  /// See tofgraph_host::change_parameter. @throws std::runtime_error the reason in words
  virtual nlohmann::json change(const std::string& node, const std::string& parameter, const std::string& value) = 0;
};

/// State shared by all instances of a run.
struct Host {
  bool overwrite = false;
  std::atomic<bool> stopping{false};
  std::atomic<bool> hashing_stopped{false};  ///< the run failed: nobody waits for the hashes of long inputs
  bool wants_hashes() const { return !stopping.load() && !hashing_stopped.load(); }
  std::function<void(const std::string& node, const std::string& text, bool warning)> message;
  std::string version;
  std::string plugin_path;                      ///< folders with colons between
  const KnownStages* known_stages = nullptr;    ///< for advice, while a graph is checked
  std::vector<std::filesystem::path> inputs{};  ///< files that the graph reads: no output may take their place

  std::shared_mutex control_mutex{};  ///< the run below: shared while it is asked, exclusive while it comes and goes
  RunControl* control = nullptr;
};

/// A file that shaped a result.
struct UsedFile {
  explicit UsedFile(std::string used) : path(std::move(used)), hash(std::make_shared<io::FileHash>(path)) {}
  std::string path;
  std::shared_ptr<const io::FileHash> hash;
};

/// Failure of a call, as stated by the plugin.
struct Failure {
  std::string parameter, text;
  bool defect = false;  ///< the host noticed that the plugin did what no plugin should
  /// The text; with the plugin's file where the user can only take the plugin out.
  std::string message(const Plugin& plugin) const;
};
/// That of the running call of this thread.
Failure& last_failure();
/// In a catch clause of a host's call, which lets nothing out: what was thrown becomes the running call's failure.
void keep_failure() noexcept;

/// Changes of a stage to its stream, in prepare.
struct OutputStream {
  Stream stream;
  io::CameraPtr own_camera;             ///< when this node changed it
  tofgraph_stream* arriving = nullptr;  ///< input of a source, with its camera once it has chosen one
};

class Instance {
 public:
  /// @param name of the node, or of the effect
  Instance(const Plugin& plugin, std::string name, Host& host);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  const Plugin& plugin() const { return plugin_; }
  const std::string& name() const { return name_; }
  void* self() const { return self_; }

  /// @param values in the order of the descriptor's parameters. @returns what went wrong
  std::optional<Failure> create(const tofgraph_value* values);
  /// @param index of the node @param leaving null: an effect, which has no stream
  std::optional<Failure> prepare(std::span<const tofgraph_stream* const> streams, std::size_t index,
                                 OutputStream* output_stream);
  /// @returns the call's status. @throws std::runtime_error what went wrong
  int process(std::span<tofgraph_frame* const> frames);
  void finish();  ///< @throws std::runtime_error
  /// Live parameters take other values, between two frames. @returns why the old ones stay
  std::optional<Failure> change(const tofgraph_value* values);
  void stop() noexcept;

  /// The files of the outputs, for a stage that has some: by the parameter's place.
  void set_outputs(std::vector<io::OutputPattern> outputs) { outputs_ = std::move(outputs); }
  void set_overwrite(bool allowed) { overwrite_ = allowed; }
  /// @param make called when the stage asks for it first, after prepare: the hashes of long files take their time
  void set_provenance(std::function<std::string()> make) { make_provenance_ = std::move(make); }
  /// Returns whether the stage requested it in prepare, which announces a request at the end.
  bool wants_provenance() const { return wants_provenance_; }
  const std::vector<UsedFile>& files() const { return files_; }
  void add_file(const std::string& path);
  /// Warnings of create and prepare, which have a place in what the user wrote.
  const std::vector<std::string>& warnings() const { return warnings_; }
  void add_note(std::string text) { notes_.push_back(std::move(text)); }
  /// Notes of the instance on itself, for `explain`.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  friend struct HostCalls;

  /// @returns whether a file that comes once in a run is asked for the first time
  bool claim(std::size_t parameter);

  const Plugin& plugin_;
  std::string name_;
  Host& host_;
  void* self_ = nullptr;
  bool starting_ = true;  ///< create and prepare are not over
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

/// The table of services, the same for every plugin.
const tofgraph_host& host_table();

}  // namespace tofgraph::graph
