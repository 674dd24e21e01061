// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tests one stage: frames in, frames out, with the plugin interface and checks of a real run. Link libtofgraph.
///
///     tofgraph::Harness stage("optimized_bistatic solver=newton");
///     stage.camera("camcube2");
///     stage.put<float>("distance", {204, 204}, values);
///     stage.run();
///     std::vector<float> depth = stage.get<float>("depth");
#pragma once

#include <tofgraph/plugin.h>
#include <tofgraph/array.hpp>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph {

class Harness {
 public:
  /// Properties of an input channel besides its content.
  struct Meaning {
    std::string unit;     ///< default: that of the standard channel
    std::string of;       ///< for sigma
    std::string applied;  ///< stages, blank-separated
    std::string from;     ///< channels, blank-separated
  };

  /// @param stage the one-line form: its name, then parameter=value
  /// @param plugin_folders searched before TOFGRAPH_PLUGIN_PATH and the installed folder
  /// @throws std::runtime_error listing all errors
  explicit Harness(const std::string& stage, const std::vector<std::string>& plugin_folders = {});
  ~Harness();

  /// Sets the camera by its profile's name or path.
  void camera(const std::string& profile);
  const tofgraph_camera& camera() const;

  /// Adds a channel to the next frame. Before the first run this also announces it.
  template <class T> void put(const std::string& channel, const std::vector<std::uint64_t>& extent,
                              const std::vector<T>& values, const Meaning& meaning = {}) {
    put_bytes(channel, element_type<T>(), extent, values.data(), values.size() * sizeof(T), meaning);
  }
  /// Metadata of the next frame.
  tofgraph_metadata& metadata();
  /// Sets the metadata that the stream announces as known; default: all.
  void known(std::uint64_t bits);
  /// Allows existing outputs to be replaced.
  void overwrite(bool allowed);

  /// Prepares the stage without a frame. @throws std::runtime_error with the stage's message
  void prepare();
  /// Runs one frame; prepares at the first call. @returns false if a source has ended. @throws std::runtime_error
  bool run();
  void finish();

  bool has(const std::string& channel) const;
  std::vector<std::uint64_t> extent(const std::string& channel) const;
  /// Content of a channel of the output frame. @throws std::runtime_error if it is missing or of another
  /// type
  template <class T> std::vector<T> get(const std::string& channel) const {
    const Array<const T> view(find(channel));
    return {view.begin(), view.end()};
  }
  /// Announced properties of an output: applied stages, and the channel of sigma.
  std::string applied(const std::string& channel) const;
  std::string of(const std::string& channel) const;
  /// Camera of the output stream.
  const tofgraph_camera& camera_out() const;
  /// Messages of the stage so far.
  const std::vector<std::string>& messages() const;

 private:
  void put_bytes(const std::string& channel, std::uint32_t type, const std::vector<std::uint64_t>& extent,
                 const void* data, std::size_t bytes, const Meaning& meaning);
  tofgraph_view find(const std::string& channel) const;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph
