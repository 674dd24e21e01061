// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Captures: recordings of a camera, frame by frame, in HDF5. The layout is that of docs/formats/capture.md; NaN is
/// "unknown". Thread-safe: captures of one process take turns.
#pragma once

#include <tofgraph/plugin.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {

/// Header of a capture.
struct CaptureHeader {
  std::string camera;  ///< the name of its profile
  std::uint32_t width = 0, height = 0;
  std::string comment, serial;               ///< optional
  std::string profile;                       ///< optional: its text
  std::string provenance;                    ///< optional, JSON; where it is not known yet: CaptureWriter::finish
  std::vector<tofgraph_exposure> exposures;  ///< a frame's; empty: the profile's
  std::vector<std::string> sources;          ///< names of the light sources that were on; empty: not stated
};

/// Dataset of /frames: N x extent.
struct CaptureChannel {
  std::string name;
  std::uint32_t type = TOFGRAPH_TYPE_ANY;  ///< in memory: flags are always uint16
  std::vector<std::uint64_t> extent;       ///< extent of one frame
  std::string unit, of, applied, from;

  std::uint64_t elements() const;
  std::uint64_t bytes() const;
};

/// Reads a capture, also while it is being recorded or after its recorder was killed.
class CaptureReader {
 public:
  /// Opens and checks all that can be known without reading the frames: format, version, shapes, types, units, and
  /// that as much is stored as is announced. @throws std::runtime_error naming the file and what is wrong
  explicit CaptureReader(const std::filesystem::path& file);
  /// Opens a file that was cut off and then extended by zeros to the size that HDF5 expects. Frames count up to the
  /// first one that does not lie within the first `end` bytes in all channels; metadata beyond them is unknown.
  /// @throws std::runtime_error also where no frame is whole
  CaptureReader(const std::filesystem::path& file, std::uint64_t end);
  ~CaptureReader();
  CaptureReader(const CaptureReader&) = delete;
  CaptureReader& operator=(const CaptureReader&) = delete;

  /// Trial of a file in a separate process: reads the first and last frame of each channel, within limits that this
  /// process keeps from then on. @throws std::exception the problem
  /// @param end as in the constructor; the default: the file is as long as it should be
  static void read_on_trial(const std::filesystem::path& file, std::uint64_t end = not_cut);

  const CaptureHeader& header() const;
  std::size_t frames() const;
  /// Number of frames that the longest channel announces.
  std::size_t announced_frames() const;
  /// False while the recording runs, or when it was cut off: frames() are then those that are complete.
  bool finished() const;
  const std::vector<CaptureChannel>& channels() const;
  /// Datasets of /frames that are neither channels nor metadata.
  const std::vector<std::string>& ignored() const;

  /// Metadata in SI (kelvin); `number` is left alone. device_number: the frame's index where it was not recorded.
  /// A time stamp of 0 is unknown.
  tofgraph_metadata metadata(std::size_t frame) const;
  /// TOFGRAPH_KNOWS_.. bits that hold for each of these frames.
  std::uint64_t known(std::size_t first, std::size_t last) const;
  /// Reads a frame of a channel, row-major, as channel.type. @throws std::runtime_error
  void read(std::size_t channel, std::size_t frame, void* data) const;

  static constexpr std::uint64_t not_cut = ~std::uint64_t{0};

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct CaptureOptions {
  int compression = 0;              ///< deflate level, 0 to 9, with byte shuffling
  bool overwrite = false;           ///< an existing capture may be replaced; a .part never is
  std::filesystem::path part = {};  ///< its name until it is finished; default: part_of()
};

/// Writes a capture: as FILE.part, which can be read meanwhile, until finish() gives it its name. Not thread-safe.
class CaptureWriter {
 public:
  /// @throws std::runtime_error also when the file or its .part exists
  CaptureWriter(std::filesystem::path file, const CaptureHeader& header, std::vector<CaptureChannel> channels,
                const CaptureOptions& options = {});
  /// Without finish() the .part stays with all its frames: what was recorded is never thrown away.
  ~CaptureWriter();
  CaptureWriter(const CaptureWriter&) = delete;
  CaptureWriter& operator=(const CaptureWriter&) = delete;

  /// Appends a frame; views in the order of the channels. After return the frame survives a kill of the process (not a
  /// power failure). @throws std::runtime_error when the disk is full, or a view is of another type or size than its
  /// channel. What was written before is whole then, and any HDF5 program can read it once the writer is gone
  void append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views);
  std::size_t frames() const;
  /// Closes the file, waits until it is on the disk and renames it. A kill meanwhile loses no frame.
  /// @param late_provenance of the frames, JSON, where the header had none; empty: none
  /// @throws std::runtime_error also where somebody made a file of that name meanwhile, without `overwrite`
  void finish(const std::string& late_provenance = {});

  /// FILE.part
  static std::filesystem::path part_of(const std::filesystem::path& file);
  /// Why a capture cannot be written there, or nothing; touches nothing. A .part is never replaced: somebody may be
  /// writing it, or it is all that is left of a recording.
  static std::string problem(const std::filesystem::path& file, bool overwrite);
  /// Returns whether a writer has this file open, in this process or another one.
  static bool is_at_work(const std::filesystem::path& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::io
