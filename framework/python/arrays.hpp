// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Channels of a frame as NumPy arrays that share their memory, and the frame as Python sees it.
#pragma once

#include "graph/frame.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::python {

namespace py = pybind11;

/// NumPy's type of a TOFGRAPH_TYPE_.. @throws py::type_error for one that has none
py::dtype dtype_of(std::uint32_t type);
/// TOFGRAPH_TYPE_.. of a NumPy type. @throws py::type_error naming the types that channels have
std::uint32_t type_of(const py::dtype& dtype);

/// TOFGRAPH_KNOWS_.. bits of fields of the metadata. @throws py::key_error for a name that no field has
std::uint64_t metadata_bits(const std::vector<std::string>& names);

/// Unit of a channel by the table of channels; empty where it is not in there.
std::string unit_of(const std::string& channel);

/// Keeps the memory of a run as long as something of it is in use.
using Pool = std::shared_ptr<graph::BufferPool>;

/// The channel's own memory as an array, kept alive by the array.
py::array array_of(const tofgraph_frame::Channel& channel, Pool pool, bool writable);

/// A frame that left a node: its channels, shared with whoever else reads them, and its metadata.
struct HeldFrame {
  explicit HeldFrame(const tofgraph_frame& frame);

  Pool pool;  ///< before the channels: it outlives their buffers
  std::vector<tofgraph_frame::Channel> channels;
  tofgraph_metadata metadata{};
};

/// Units of channels by name.
using Units = std::map<std::string, std::string, std::less<>>;

/// A frame in the hands of a stage written in Python, valid during the call.
class StageFrame {
 public:
  /// @param units of the channels that the stage declares or announces; it outlives the call
  StageFrame(tofgraph_frame* frame, const Units& units) : frame_(frame), units_(&units) {}
  /// From now on what was lent cannot be written.
  void end();
  /// @throws std::runtime_error after the call
  tofgraph_frame& get() const;
  /// Puts an array in a channel's place, without a copy where the array owns its memory and has no gaps.
  void set(const std::string& channel, const py::array& array) const;
  /// An array that may be written: the channel's own memory, or a copy where others read it, too.
  py::array modify(const std::string& channel) const;

 private:
  tofgraph_frame* frame_;
  const Units* units_;
  mutable std::map<std::string, py::array> modified_;  ///< that modify() lent
};

/// The classes `Frame` and `StageFrame`.
void add_frames(py::module_& module);

}  // namespace tofgraph::python
