// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture.hpp"
#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/captures/capture_layout.hpp"
#include "io/captures/disk_space.hpp"
#include "io/output_file.hpp"

#include <tofgraph/array.hpp>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <numeric>
#include <system_error>

namespace tofgraph::io {
namespace fs = std::filesystem;
using h5::check;
using h5::Handle;
using h5::write_text;

std::uint64_t CaptureChannel::elements() const {
  return std::accumulate(extent.begin(), extent.end(), std::uint64_t{1}, std::multiplies<>());
}
std::uint64_t CaptureChannel::bytes() const { return elements() * element_size(type); }

namespace {

/// Frames of a metadata array in one chunk: small, because each flush writes the last one again.
constexpr hsize_t metadata_chunk = 128;

/// What HDF5 may need beside the frames: indices that grow, what it writes when it closes the file.
constexpr std::uint64_t room_for_indices = 1U << 20U;  // bytes

void write_optional(hid_t object, const char* name, const std::string& value) {
  if (!value.empty()) write_text(object, name, value);
}

void write_integer(hid_t object, const char* name, std::int64_t value) {
  const Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, H5T_STD_I64LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_INT64, &value), fmt::format("attribute {} cannot be written", name));
}

/// The newest format is the one that can be read while it is written, and that a kill cannot leave torn (SWMR).
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

/// A dataset that grows by one frame at a time.
struct Series {
  Handle dataset, frame_space;
  std::vector<hsize_t> size;  // number of frames first
  hid_t memory = H5I_INVALID_HID;
  std::string name;

  Series(hid_t group, std::string series_name, hid_t stored_as, hid_t memory_type,
         const std::vector<std::uint64_t>& extent, hsize_t chunk_frames, int compression)
      : memory(memory_type), name(std::move(series_name)) {
    size.push_back(0);
    size.insert(size.end(), extent.begin(), extent.end());
    std::vector<hsize_t> chunk = size, most = size;
    chunk[0] = chunk_frames;
    most[0] = H5S_UNLIMITED;
    const int rank = static_cast<int>(size.size());
    const Handle space(H5Screate_simple(rank, size.data(), most.data()), H5Sclose);
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    check(H5Pset_chunk(creation, rank, chunk.data()), "the chunks of " + name);
    if (compression > 0) {
      check(H5Pset_shuffle(creation), "byte shuffling");
      check(H5Pset_deflate(creation, static_cast<unsigned>(compression)), "compression");
    }
    const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
    // A chunk that is a whole frame goes straight to the file.
    if (chunk_frames == 1) check(H5Pset_chunk_cache(access, 0, 0, H5D_CHUNK_CACHE_W0_DEFAULT), "the chunk cache");
    dataset = Handle(check(H5Dcreate2(group, name.c_str(), stored_as, space, H5P_DEFAULT, creation, access),
                           name + " cannot be created"),
                     H5Dclose);
    std::vector<hsize_t> one = size;
    one[0] = 1;
    frame_space = Handle(H5Screate_simple(rank, one.data(), nullptr), H5Sclose);
  }

  void append(const void* data) {
    std::vector<hsize_t> start(size.size(), 0), count = size;
    start[0] = size[0]++;
    count[0] = 1;
    check(H5Dset_extent(dataset, size.data()), name + " cannot grow");
    const Handle space(H5Dget_space(dataset), H5Sclose);
    check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr), name);
    check(H5Dwrite(dataset, memory, frame_space, space, H5P_DEFAULT, data), name + " cannot be written");
  }
};

}  // namespace

struct CaptureWriter::Impl {
  fs::path file, part;
  std::vector<CaptureChannel> channels;
  CaptureOptions options;
  std::unique_ptr<DiskSpace> space;  // outlives the file: what is reserved is used when it is closed
  Handle h5;
  std::vector<Series> series, metadata;
  std::uint64_t frame_bytes = 0;  // at most, with what compression may add
  std::size_t frames = 0;
  bool broken = false;

  void create(const CaptureHeader& header);
  void check_view(const tofgraph_view& view, const CaptureChannel& channel) const;
  void append_metadata(const tofgraph_metadata& values);
  void divert_writing();
  void close();
  void close_whole();
  void add_provenance(const std::string& text);
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
  h5 = Handle(check(H5Fcreate(part.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, access()), "cannot be made"), H5Fclose);
  write_text(h5, "format", layout::format);
  write_integer(h5, "version", layout::version);
  write_text(h5, "camera", header.camera);
  write_integer(h5, "width", header.width);
  write_integer(h5, "height", header.height);
  write_optional(h5, "comment", header.comment);
  write_optional(h5, "profile", header.profile);
  write_optional(h5, "serial", header.serial);
  if (!header.exposures.empty()) {
    std::vector<double> phases, frequencies;
    for (const tofgraph_exposure& exposure : header.exposures) {
      phases.push_back(exposure.phase);
      frequencies.push_back(exposure.frequency);
    }
    write_numbers(h5, layout::phase, phases);
    write_numbers(h5, layout::frequency, frequencies);
  }
  const Handle group(
      check(H5Gcreate2(h5, layout::group, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), "the group frames cannot be created"),
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
  check(H5Fstart_swmr_write(h5), "cannot be made readable while it is written");
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
  self.broken = true;  // until the frame is whole
  const h5::Lock lock;
  try {
    self.space->reserve(self.frame_bytes + room_for_indices);
  } catch (const std::exception& problem) {
    self.fail(problem.what());
  }
  try {
    for (std::size_t i = 0; i < views.size(); ++i) self.series[i].append(views[i].data);
    self.append_metadata(metadata);
    check(H5Fflush(self.h5, H5F_SCOPE_LOCAL), "cannot be written");  // not measurable beside the writing itself
  } catch (const std::exception& problem) {
    self.divert_writing();
    self.fail(problem.what());
  }
  self.broken = false;
  ++self.frames;
}

std::size_t CaptureWriter::frames() const { return impl_->frames; }

/// After a failure inside of HDF5: it would try again whenever it can, and leave a frame that is not there.
void CaptureWriter::Impl::divert_writing() {
  void* descriptor = nullptr;
  if (H5Fget_vfd_handle(h5, H5P_DEFAULT, &descriptor) >= 0 && descriptor != nullptr)
    divert(*static_cast<int*>(descriptor));
  H5Eclear2(H5E_DEFAULT);
}

void CaptureWriter::Impl::close() {
  series.clear();
  metadata.clear();
  h5.reset();
  space.reset();
}

void CaptureWriter::Impl::close_whole() {
  series.clear();
  metadata.clear();
  if (H5Fclose(h5.release()) < 0) fail("cannot be written: " + h5::last_error());
}

/// Opens the file again: while others may read it, nothing can be added to it but frames.
void CaptureWriter::Impl::add_provenance(const std::string& text) {
  try {
    h5 = Handle(check(H5Fopen(part.c_str(), H5F_ACC_RDWR, access()), "cannot be opened again"), H5Fclose);
    write_text(h5, "provenance", text);
  } catch (const std::exception& problem) {
    fail(problem.what());
  }
  close_whole();
}

void CaptureWriter::finish(const std::string& provenance) {
  Impl& self = *impl_;
  if (self.broken) self.fail("was not written completely");
  {
    const h5::Lock lock;
    self.close_whole();
    if (!provenance.empty()) self.add_provenance(provenance);
    self.space.reset();
  }
  const int descriptor = open(self.part.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = descriptor >= 0 && (fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP);
  const int why = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced) self.fail("cannot be written: " + std::generic_category().message(why));
  std::error_code error;
  fs::rename(self.part, self.file, error);
  if (error) self.fail("cannot be renamed: " + error.message());
}

}  // namespace tofgraph::io
