// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture.hpp"
#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/captures/capture_layout.hpp"
#include "io/captures/capture_series.hpp"
#include "io/captures/disk_space.hpp"
#include "io/captures/part_file.hpp"
#include "io/output_file.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <numeric>
#include <system_error>

namespace tofgraph::io {
namespace fs = std::filesystem;
using h5::check;
using h5::Handle;
using h5::LateText;
using h5::Series;
using h5::write_text;

std::uint64_t CaptureChannel::elements() const {
  return std::accumulate(extent.begin(), extent.end(), std::uint64_t{1}, std::multiplies<>());
}
std::uint64_t CaptureChannel::bytes() const { return elements() * element_size(type); }

namespace {

/// Frames per chunk of a metadata array: small, because each flush rewrites the last chunk.
constexpr hsize_t metadata_chunk = 128;

/// Space that HDF5 may need in addition to the frames: growing indices, data written at closing.
constexpr std::uint64_t room_for_indices = 1U << 20U;  // bytes

void write_optional(hid_t object, const char* name, const std::string& value) {
  if (!value.empty()) write_text(object, name, value);
}

void write_integer(hid_t object, const char* name, std::int64_t value) {
  const Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, H5T_STD_I64LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_INT64, &value), fmt::format("attribute {} cannot be written", name));
}

/// The latest file format, which supports reading during writing and stays consistent after a kill (SWMR).
Handle access() {
  Handle properties(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(H5Pset_libver_bounds(properties, H5F_LIBVER_V110, H5F_LIBVER_V110), "the format's version");
  check(H5Pset_file_locking(properties, true, true), "file locking");
  return properties;
}

hid_t file_type(std::uint32_t element_type) {
  switch (element_type) {
    case TOFGRAPH_TYPE_F32:
      return H5T_IEEE_F32LE;
    case TOFGRAPH_TYPE_F64:
      return H5T_IEEE_F64LE;
    case TOFGRAPH_TYPE_U8:
      return H5T_STD_U8LE;
    case TOFGRAPH_TYPE_U16:
      return H5T_STD_U16LE;
    case TOFGRAPH_TYPE_I16:
      return H5T_STD_I16LE;
    default:
      return H5T_STD_I32LE;
  }
}

}  // namespace

struct CaptureWriter::Impl {
  fs::path file, part;
  std::vector<CaptureChannel> channels;
  CaptureOptions options;
  std::unique_ptr<DiskSpace> space;  // outlives the file, whose closing uses the reservation
  std::unique_ptr<PartFile> part_file;
  Handle h5;
  std::vector<Series> series, metadata;
  LateText provenance;
  std::uint64_t frame_bytes = 0;  // maximum, including the overhead of compression
  std::size_t frames = 0;
  bool broken = false;

  void create(const CaptureHeader& header);
  void check_view(const tofgraph_view& view, const CaptureChannel& channel) const;
  void append_metadata(const tofgraph_metadata& values);
  void divert_writing();
  void close();
  void close_whole(const std::string& text);
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(fmt::format("{}: {}", part.string(), why));
  }
};

fs::path CaptureWriter::part_of(const fs::path& file) { return file.string() + ".part"; }

std::string CaptureWriter::problem(const fs::path& file, bool overwrite) {
  const fs::path part = part_of(file);
  std::string why_not = output_problem(file, overwrite);
  if (why_not.empty()) why_not = write_error(part);
  std::error_code error;
  if (!why_not.empty() || !fs::exists(fs::symlink_status(part, error))) return why_not;
  return fmt::format(
      "{} already exists: a recording that is still running, or the frames of one that was cut off; it is never "
      "replaced: "
      "read it (capture_reader file={}), make a capture of it (tofgraph repair {}), or move it away",
      part.string(), part.string(), part.string());
}

CaptureWriter::CaptureWriter(fs::path file, const CaptureHeader& header, std::vector<CaptureChannel> channels,
                             const CaptureOptions& options)
    : impl_(std::make_unique<Impl>()) {
  Impl& self = *impl_;
  self.part = options.part.empty() ? part_of(file) : options.part;
  self.file = std::move(file);
  self.channels = std::move(channels);
  self.options = options;
  const std::string why_not =
      options.part.empty() ? problem(self.file, options.overwrite) : output_problem(self.file, options.overwrite);
  if (!why_not.empty()) throw std::runtime_error(why_not);
  std::error_code error;
  if (self.file.has_parent_path()) fs::create_directories(self.file.parent_path(), error);
  if (error) self.fail("the folder cannot be created: " + error.message());
  const h5::Lock lock;
  try {
    self.create(header);
  } catch (const std::exception& problem) {
    const bool made_here = static_cast<bool>(self.h5);
    self.close();
    if (made_here) fs::remove(self.part, error);  // it has no frame yet
    self.fail(problem.what());
  }
}

CaptureWriter::~CaptureWriter() {
  const h5::Lock lock;
  impl_->close();
}

void CaptureWriter::Impl::create(const CaptureHeader& header) {
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation, false);  // for reproducible files
  h5 = Handle(check(H5Fcreate(part.c_str(), H5F_ACC_EXCL, creation, access()), "cannot be made"), H5Fclose);
  write_text(h5, "format", layout::format);
  write_integer(h5, "version", layout::version);
  write_text(h5, "camera", header.camera);
  write_integer(h5, "width", header.width);
  write_integer(h5, "height", header.height);
  write_optional(h5, "comment", header.comment);
  write_optional(h5, "profile", header.profile);
  write_optional(h5, "serial", header.serial);
  write_optional(h5, "sources", fmt::format("{}", fmt::join(header.sources, ", ")));
  write_optional(h5, layout::provenance, header.provenance);
  if (!header.exposures.empty()) {
    std::vector<double> phases, frequencies;
    for (const tofgraph_exposure& exposure : header.exposures) {
      phases.push_back(exposure.phase);
      frequencies.push_back(exposure.frequency);
    }
    write_numbers(h5, layout::phase, phases);
    write_numbers(h5, layout::frequency, frequencies);
  }
  const Handle of_group(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  H5Pset_obj_track_times(of_group, false);
  const Handle group(
      check(H5Gcreate2(h5, layout::group, H5P_DEFAULT, of_group, H5P_DEFAULT), "the group frames cannot be created"),
      H5Gclose);
  for (const CaptureChannel& channel : channels) {
    Series& made = series.emplace_back(group, channel.name, file_type(channel.type), h5::memory_type(channel.type),
                                       channel.extent, 1, options.compression);
    write_optional(made.dataset, "unit", channel.unit);
    write_optional(made.dataset, "of", channel.of);
    write_optional(made.dataset, "applied", channel.applied);
    write_optional(made.dataset, "from", channel.from);
    frame_bytes += channel.bytes() + channel.bytes() / 8 + 4096;
  }
  for (const layout::Metadata& array : layout::metadata)
    metadata.emplace_back(group, array.name, array.file_type(), array.memory_type(), std::vector<std::uint64_t>{},
                          metadata_chunk, 0);
  if (header.provenance.empty()) provenance = LateText(h5, layout::provenance);
  check(H5Fstart_swmr_write(h5), "cannot be made readable while it is written");
  part_file = std::make_unique<PartFile>(part);
  space = std::make_unique<DiskSpace>(part);
  space->reserve(room_for_indices);
}

void CaptureWriter::Impl::check_view(const tofgraph_view& view, const CaptureChannel& channel) const {
  const std::vector<std::uint64_t> extent(view.extent, view.extent + view.rank);
  auto stride = static_cast<std::int64_t>(element_size(channel.type));
  bool right = view.data != nullptr && view.type == channel.type && extent == channel.extent;
  for (std::size_t i = extent.size(); right && i-- > 0;) {
    right = view.stride[i] == stride;
    stride *= static_cast<std::int64_t>(extent[i]);
  }
  if (right) return;
  fail(fmt::format("frame {} of {} is {} {}, expected {} {} without gaps", frames, channel.name,
                   element_name(view.type), fmt::join(extent, " x "), element_name(channel.type),
                   fmt::join(channel.extent, " x ")));
}

void CaptureWriter::Impl::append_metadata(const tofgraph_metadata& values) {
  for (std::size_t i = 0; i < metadata.size(); ++i) {
    const layout::Element element = layout::metadata[i].stored(values);
    metadata[i].append(&element);
  }
}

void CaptureWriter::append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views) {
  Impl& self = *impl_;
  if (views.size() != self.channels.size()) self.fail("expected as many views as channels");
  for (std::size_t i = 0; i < views.size(); ++i) self.check_view(views[i], self.channels[i]);
  if (self.broken) self.fail("was not written completely");
  self.broken = true;  // until the frame is complete
  const h5::Lock lock;
  try {
    self.space->reserve(self.frame_bytes + room_for_indices);
  } catch (const std::exception& problem) {
    self.fail(problem.what());
  }
  try {
    for (std::size_t i = 0; i < views.size(); ++i) self.series[i].append(views[i].data);
    self.append_metadata(metadata);
    check(H5Fflush(self.h5, H5F_SCOPE_LOCAL), "cannot be written");  // negligible cost compared with writing
  } catch (const std::exception& problem) {
    self.divert_writing();
    self.fail(problem.what());
  }
  self.broken = false;
  ++self.frames;
}

std::size_t CaptureWriter::frames() const { return impl_->frames; }

/// Called after a failure inside HDF5, which would otherwise retry and leave an invalid frame.
void CaptureWriter::Impl::divert_writing() {
  void* descriptor = nullptr;
  if (H5Fget_vfd_handle(h5, H5P_DEFAULT, &descriptor) >= 0 && descriptor != nullptr)
    divert(*static_cast<int*>(descriptor));
  H5Eclear2(H5E_DEFAULT);
}

void CaptureWriter::Impl::close() {
  series.clear();
  metadata.clear();
  provenance.close();
  h5.reset();
  space.reset();
  part_file.reset();
}

/// Last step of writing: a kill before its end leaves the state of the last flush.
void CaptureWriter::Impl::close_whole(const std::string& text) {
  try {
    if (!text.empty() && provenance) {
      space->reserve(2 * text.size() + room_for_indices);
      provenance.write(text);
    }
  } catch (const std::exception& problem) {
    divert_writing();
    fail(problem.what());
  }
  series.clear();
  metadata.clear();
  provenance.close();
  if (H5Fclose(h5.release()) < 0) fail("cannot be written: " + h5::last_error());
  space.reset();
}

void CaptureWriter::finish(const std::string& late_provenance) {
  Impl& self = *impl_;
  if (self.broken) self.fail("was not written completely");
  {
    const h5::Lock lock;
    self.close_whole(late_provenance);
  }
  try {
    self.part_file->sync();
    self.part_file->give_name(self.file, self.options.overwrite);
  } catch (const std::exception& problem) {
    self.fail(problem.what());
  }
}

}  // namespace tofgraph::io
