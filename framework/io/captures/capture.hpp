// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Captures: recordings of a camera, frame by frame, in HDF5. The layout is documented in docs/formats/capture.md; NaN
/// means unknown. Thread-safe: the captures of a process share one lock.
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
  std::string camera;  ///< name of its profile
  std::uint32_t width = 0, height = 0;
  std::string comment, serial;               ///< optional
  std::string profile;                       ///< optional: text of the profile
  std::string provenance;                    ///< optional, JSON; if not yet known: CaptureWriter::finish
  std::vector<tofgraph_exposure> exposures;  ///< of each frame; empty: the profile's
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

/// Reads a capture, also during recording and after the recorder was killed.
class CaptureReader {
 public:
  /// Opens the file and checks everything that does not require reading frames: format, version, shapes, types, units,
  /// and the announced amount of data. @throws std::runtime_error naming the file and the problem
  explicit CaptureReader(const std::filesystem::path& file);
  /// Opens a truncated file that was extended with zeros to the size that HDF5 expects. Frames are used up to the
  /// first that is not within the first `end` bytes in all channels; metadata beyond `end` are unknown.
  /// @throws std::runtime_error also if no frame is complete
  CaptureReader(const std::filesystem::path& file, std::uint64_t end);
  ~CaptureReader();
  CaptureReader(const CaptureReader&) = delete;
  CaptureReader& operator=(const CaptureReader&) = delete;

  /// Test of a file, to be run in a separate process: reads the first and last frame of each channel under resource
  /// limits that remain in effect for the process. @throws std::exception the problem
  /// @param end as in the constructor; default: the file is not truncated
  static void read_on_trial(const std::filesystem::path& file, std::uint64_t end = not_cut);

  const CaptureHeader& header() const;
  std::size_t frames() const;
  /// Number of frames that the longest channel announces.
  std::size_t announced_frames() const;
  /// False during recording, or if the recording was cut off: frames() then counts the complete frames.
  bool finished() const;
  const std::vector<CaptureChannel>& channels() const;
  /// Datasets of /frames that are neither channels nor metadata.
  const std::vector<std::string>& ignored() const;

  /// Metadata in SI (kelvin); `number` is not changed. device_number: the frame's index if it was not recorded.
  /// A time stamp of 0 means unknown.
  tofgraph_metadata metadata(std::size_t frame) const;
  /// False if the recorder stored no frame numbers.
  bool has_frame_numbers() const;
  /// TOFGRAPH_KNOWS_.. bits that are set for each of these frames.
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
  bool overwrite = false;           ///< an existing capture may be replaced, a .part never
  std::filesystem::path part = {};  ///< name until it is finished; default: part_of()
};

/// Writes a capture as FILE.part, readable during recording; finish() renames it to FILE. Not thread-safe.
class CaptureWriter {
 public:
  /// @throws std::runtime_error also if the file or its .part exists
  CaptureWriter(std::filesystem::path file, const CaptureHeader& header, std::vector<CaptureChannel> channels,
                const CaptureOptions& options = {});
  /// Without finish() the .part with all its frames remains: recorded data are never discarded.
  ~CaptureWriter();
  CaptureWriter(const CaptureWriter&) = delete;
  CaptureWriter& operator=(const CaptureWriter&) = delete;

  /// Appends a frame; views in the order of the channels. After return the frame survives a kill of the process (but
  /// not a power failure). @throws std::runtime_error if the disk is full, or a view has the wrong type or size for its
  /// channel. Earlier frames remain intact, and any HDF5 program can read them once the writer is closed
  void append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views);
  std::size_t frames() const;
  /// Closes the file, syncs it to disk and renames it. A kill during this call loses no frame.
  /// @param late_provenance of the frames, JSON, if the header had none; empty: none
  /// @throws std::runtime_error also if a file of that name was created meanwhile, without `overwrite`
  void finish(const std::string& late_provenance = {});

  /// Returns FILE.part.
  static std::filesystem::path part_of(const std::filesystem::path& file);
  /// Reason why a capture cannot be written there; empty: it can. Does not write anything. A .part is never replaced:
  /// it may be open in a writer, or be all that remains of a recording.
  static std::string problem(const std::filesystem::path& file, bool overwrite);
  /// Returns true if a writer has this file open, in this process or another one.
  static bool is_at_work(const std::filesystem::path& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::io
