// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Channels of a frame as NumPy arrays that share their memory, and the Python view of a frame.
#pragma once

#include "graph/frame.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::python {

namespace py = pybind11;

/// NumPy type of a TOFGRAPH_TYPE_... @throws py::type_error if there is none
py::dtype dtype_of(std::uint32_t type);
/// TOFGRAPH_TYPE_.. of a NumPy type. @throws py::type_error naming the types allowed in channels
std::uint32_t type_of(const py::dtype& dtype);

/// TOFGRAPH_KNOWS_.. bits of metadata fields. @throws py::key_error for an unknown field name
std::uint64_t metadata_bits(const std::vector<std::string>& names);

/// Unit of a channel in the table of channels; empty for a non-standard channel.
std::string unit_of(const std::string& channel);

/// Keeps the memory of a run alive as long as any of it is in use.
using Pool = std::shared_ptr<graph::BufferPool>;

/// Returns the channel's own memory as an array, which keeps it alive.
py::array array_of(const tofgraph_frame::Channel& channel, Pool pool, bool writable);

/// Frame that left a node: its channels, shared with all other readers, and its metadata.
struct HeldFrame {
  explicit HeldFrame(const tofgraph_frame& frame);

  Pool pool;  ///< before the channels because it must outlive their buffers
  std::vector<tofgraph_frame::Channel> channels;
  tofgraph_metadata metadata{};
};

/// Channels that a stage may write ("*": every channel), with the unit of those that it creates.
using Outputs = std::map<std::string, std::optional<std::string>, std::less<>>;

/// Frame passed to a stage written in Python, valid during the call.
class StageFrame {
 public:
  /// @param outputs channels that the stage declares or announces; must outlive the call
  StageFrame(tofgraph_frame* frame, const Outputs& outputs) : frame_(frame), outputs_(&outputs) {}
  /// Makes all lent arrays read-only.
  void end();
  /// @throws std::runtime_error after the call has ended
  tofgraph_frame& get() const;
  /// Stores an array as a channel, without a copy if the array owns its memory and is contiguous.
  /// @throws py::type_error if the stage may not write the channel, or if it is not an array that a channel can hold
  void set(const std::string& channel, const py::object& array) const;
  /// Returns a writable array: the channel's own memory, or a copy if it has other readers.
  /// @throws py::type_error if the stage may not write the channel
  py::array modify(const std::string& channel) const;

 private:
  /// Unit given to a channel that the stage may write, or nothing if it keeps its unit.
  const std::optional<std::string>& unit_to_write(const std::string& channel) const;

  tofgraph_frame* frame_;
  const Outputs* outputs_;
  mutable std::map<std::string, py::array> modified_;  ///< arrays lent by modify()
};

/// The classes `Frame` and `StageFrame`.
void add_frames(py::module_& module);

}  // namespace tofgraph::python
