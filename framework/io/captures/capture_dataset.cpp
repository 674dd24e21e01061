// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_dataset.hpp"

#include "config/log.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace tofgraph::io::h5 {
namespace {

constexpr std::size_t longest_text = 1U << 24U;  // bytes
constexpr std::size_t max_frame = 1ULL << 31U;   // bytes of one frame of a channel
constexpr std::size_t max_chunk = 64ULL << 20U;  // bytes per read if larger than a frame
constexpr int max_rank = 5;                      // frames and four dimensions

/// Saturating product: overflow gives the largest number.
std::uint64_t product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result = 0;
  return __builtin_mul_overflow(a, b, &result) ? std::numeric_limits<std::uint64_t>::max() : result;
}

std::uint64_t product(const std::vector<hsize_t>& factors, std::size_t first) {
  std::uint64_t result = 1;
  for (std::size_t i = first; i < factors.size(); ++i) result = product(result, factors[i]);
  return result;
}

Handle open_attribute(hid_t object, const char* name, std::size_t most = 1) {
  const htri_t exists = H5Aexists(object, name);
  if (exists <= 0) {
    H5Eclear2(H5E_DEFAULT);
    return {};
  }
  Handle attribute(check(H5Aopen(object, name, H5P_DEFAULT), fmt::format("attribute {}", name)), H5Aclose);
  const Handle space(check(H5Aget_space(attribute), fmt::format("attribute {}", name)), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 1 || static_cast<std::size_t>(count) > most)
    throw std::runtime_error(most == 1
                                 ? fmt::format("attribute {} is not one value", name)
                                 : fmt::format("attribute {} has {} values, expected 1 to {}", name, count, most));
  return attribute;
}

/// Extents required by a shape of the channel table: "P H W", 0 for dimensions the capture does not state. Empty for a
/// channel without a fixed shape.
std::vector<hsize_t> expected_extent(const ChannelInfo& info, const CaptureHeader& header) {
  std::vector<hsize_t> extent;
  std::string_view shape = info.shape;
  while (!shape.empty()) {
    const auto end = std::min(shape.find(' '), shape.size());
    const std::string_view word = shape.substr(0, end);
    hsize_t number = word == "H"   ? header.height
                     : word == "W" ? header.width
                     : word == "P" ? header.exposures.size()
                                   : 0;
    if (number == 0) std::from_chars(word.data(), word.data() + word.size(), number);
    extent.push_back(number);
    shape.remove_prefix(std::min(end + 1, shape.size()));
  }
  return extent;
}

std::vector<std::uint32_t> expected_types(const ChannelInfo& info) {
  const std::string_view name = info.name;
  if (name == "phases") return {TOFGRAPH_TYPE_F32, TOFGRAPH_TYPE_I16, TOFGRAPH_TYPE_I32};
  if (name == "flags") return {TOFGRAPH_TYPE_U16, TOFGRAPH_TYPE_U8};
  return {info.type};
}

std::string shown(const std::vector<hsize_t>& extent) {
  std::string text;
  for (const hsize_t size : extent)
    text += (text.empty() ? "" : " x ") + (size == 0 ? std::string("P (3 to 32)") : fmt::format("{}", size));
  return text;
}

std::string names_of(const std::vector<std::uint32_t>& types) {
  std::vector<std::string> names;
  for (const std::uint32_t type : types) names.emplace_back(element_name(type));
  return fmt::format("{}", fmt::join(names, " or "));
}

}  // namespace

std::vector<double> numbers_attribute(hid_t object, const char* name, std::size_t most) {
  const Handle attribute = open_attribute(object, name, most);
  if (!attribute) return {};
  const Handle space(check(H5Aget_space(attribute), fmt::format("attribute {}", name)), H5Sclose);
  const Handle type(check(H5Aget_type(attribute), fmt::format("attribute {}", name)), H5Tclose);
  if (H5Tget_class(type) != H5T_FLOAT && H5Tget_class(type) != H5T_INTEGER)
    throw std::runtime_error(fmt::format("attribute {} does not contain numbers", name));
  std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  check(H5Aread(attribute, H5T_NATIVE_DOUBLE, values.data()), fmt::format("attribute {} cannot be read", name));
  return values;
}

void write_numbers(hid_t object, const char* name, const std::vector<double>& values) {
  const hsize_t size = values.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle attribute(check(H5Acreate2(object, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT),
                               fmt::format("attribute {} cannot be created", name)),
                         H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_DOUBLE, values.data()), fmt::format("attribute {} cannot be written", name));
}

void write_text(hid_t object, const char* name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* text = value.c_str();
  check(H5Awrite(attribute, type, &text), fmt::format("attribute {} cannot be written", name));
}

std::string text_attribute(hid_t object, const char* name) {
  const Handle attribute = open_attribute(object, name);
  if (!attribute) return {};
  const Handle type(check(H5Aget_type(attribute), fmt::format("attribute {}", name)), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING) throw std::runtime_error(fmt::format("attribute {} is not text", name));
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    const Handle memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    check(H5Aread(attribute, memory, &text), fmt::format("attribute {} cannot be read", name));
    std::string result = text != nullptr ? text : "";
    H5free_memory(text);
    return result;
  }
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > longest_text)
    throw std::runtime_error(fmt::format("attribute {} announces {} bytes", name, size));
  std::string text(size, '\0');
  check(H5Aread(attribute, type, text.data()), fmt::format("attribute {} cannot be read", name));
  text.resize(text.find_last_not_of(std::string_view("\0 ", 2)) + 1);
  return text.substr(0, text.find('\0'));
}

std::int64_t integer_attribute(hid_t object, const char* name) {
  const Handle attribute = open_attribute(object, name);
  if (!attribute) throw std::runtime_error(fmt::format("has no attribute {}", name));
  const Handle type(check(H5Aget_type(attribute), fmt::format("attribute {}", name)), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  double value = 0;
  if (kind != H5T_INTEGER && kind != H5T_FLOAT)
    throw std::runtime_error(fmt::format("attribute {} is not a number", name));
  check(H5Aread(attribute, H5T_NATIVE_DOUBLE, &value), fmt::format("attribute {} cannot be read", name));
  if (!(std::abs(value) < 1e15) || value != std::floor(value))
    throw std::runtime_error(fmt::format("attribute {} is {}, expected a whole number", name, value));
  return static_cast<std::int64_t>(value);
}

Dataset::Dataset(hid_t group, std::string name, std::uint64_t end, const std::string& folder)
    : name_(std::move(name)), where_(folder + name_), end_(end) {
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  dataset_ = Handle(check(H5Dopen2(group, name_.c_str(), access), where_ + " cannot be opened"), H5Dclose);
  space_ = Handle(check(H5Dget_space(dataset_), where_), H5Sclose);
  type_ = Handle(check(H5Dget_type(dataset_), where_), H5Tclose);
  const int rank = H5Sget_simple_extent_ndims(space_);
  if (rank < 1 || rank > max_rank) fail(fmt::format("has {} dimensions, expected 1 to {}", rank, max_rank));
  size_.resize(static_cast<std::size_t>(rank));
  check(H5Sget_simple_extent_dims(space_, size_.data(), nullptr), where_);
  check_storage();
  std::vector<hsize_t> one = size_;
  one[0] = 1;
  frame_space_ = Handle(H5Screate_simple(rank, one.data(), nullptr), H5Sclose);
}

void Dataset::fail(const std::string& why) const { throw std::runtime_error(fmt::format("{} {}", where_, why)); }

void Dataset::check_storage() {
  const Handle creation(check(H5Dget_create_plist(dataset_), where_), H5Pclose);
  if (H5Pget_external_count(creation) != 0 || H5Pget_layout(creation) == H5D_VIRTUAL) fail("is stored in another file");
  if (const std::string missing = missing_filter(dataset_); !missing.empty()) fail(missing);
  const std::uint64_t frame = product(product(size_, 1), H5Tget_size(type_));
  if (frame > max_frame) fail(fmt::format("is {}: such frames are not read", described()));
  if (H5Pget_layout(creation) != H5D_CHUNKED) return;
  chunk_.resize(size_.size());
  check(H5Pget_chunk(creation, static_cast<int>(chunk_.size()), chunk_.data()), where_);
  filtered_ = H5Pget_nfilters(creation) > 0;
  is_frame_ = chunk_[0] == 1 && std::equal(chunk_.begin() + 1, chunk_.end(), size_.begin() + 1);
  const std::uint64_t bytes = product(product(chunk_, 0), H5Tget_size(type_));
  if (bytes == 0 || bytes > std::max<std::uint64_t>(max_chunk, frame)) {
    fail(fmt::format("is stored in chunks of {}, {} bytes each, expected one chunk per frame: h5repack can change that",
                     fmt::join(chunk_, " x "), bytes));
  }
}

/// True if the chunk at these elements lies within the truncated file.
bool Dataset::is_whole(const std::vector<hsize_t>& chunk) const {
  unsigned filters = 0;
  haddr_t place = HADDR_UNDEF;
  hsize_t bytes = 0;
  const bool known = H5Dget_chunk_info_by_coord(dataset_, chunk.data(), &filters, &place, &bytes) >= 0;
  if (!known) H5Eclear2(H5E_DEFAULT);  // its index entry is lost
  return known && place != HADDR_UNDEF && place <= end_ && bytes <= end_ - place;
}

/// Number of leading frames that lie within the truncated file.
std::size_t Dataset::whole_frames() const {
  if (chunk_.empty()) {
    const haddr_t place = H5Dget_offset(dataset_);
    H5Eclear2(H5E_DEFAULT);
    if (place == HADDR_UNDEF) return H5Dget_storage_size(dataset_) > 0 ? frames() : 0;  // in the dataset's header
    const std::uint64_t frame = std::max<std::uint64_t>(product(product(size_, 1), H5Tget_size(type_)), 1);
    return static_cast<std::size_t>(std::min<std::uint64_t>(size_[0], place < end_ ? (end_ - place) / frame : 0));
  }
  std::vector<hsize_t> chunk(size_.size(), 0);
  for (;;) {  // the last dimension varies fastest, frames slowest
    if (!is_whole(chunk)) return static_cast<std::size_t>(chunk[0]);
    std::size_t i = size_.size() - 1;
    while (i > 0 && chunk[i] + chunk_[i] >= size_[i]) chunk[i--] = 0;
    chunk[i] += chunk_[i];
    if (chunk[0] >= size_[0]) return frames();
  }
}

std::size_t Dataset::stored_frames(bool all) const {
  if (end_ != CaptureReader::not_cut) return whole_frames();
  std::uint64_t stored = 0;
  if (!chunk_.empty()) {
    hsize_t chunks = 0;
    check(H5Dget_num_chunks(dataset_, space_, &chunks), where_ + ": its chunks cannot be found");
    std::uint64_t a_slab = 1;  // number of chunks with the same frames
    for (std::size_t i = 1; i < size_.size(); ++i) a_slab = product(a_slab, (size_[i] + chunk_[i] - 1) / chunk_[i]);
    stored = std::min<std::uint64_t>(size_[0], product(chunks / std::max<std::uint64_t>(a_slab, 1), chunk_[0]));
  } else {
    const std::uint64_t frame = std::max<std::uint64_t>(product(product(size_, 1), H5Tget_size(type_)), 1);
    stored = std::min<std::uint64_t>(size_[0], H5Dget_storage_size(dataset_) / frame);
  }
  if (all && stored != size_[0])
    fail(fmt::format("announces {}, but {} stored", config::counted(size_[0], "frame"),
                     stored == 1 ? "1 is" : fmt::format("{} are", stored)));
  return static_cast<std::size_t>(stored);
}

std::string Dataset::described() const {
  const std::uint32_t type = element_type_of(type_);
  return fmt::format("{} {}", fmt::join(size_, " x "),
                     type != TOFGRAPH_TYPE_ANY ? element_name(type) : "of another type");
}

std::optional<CaptureChannel> Dataset::as_channel(const CaptureHeader& header) const {
  CaptureChannel channel;
  channel.name = name_;
  channel.type = element_type_of(type_);
  channel.extent.assign(size_.begin() + 1, size_.end());
  channel.unit = text_attribute(dataset_, "unit");
  channel.of = text_attribute(dataset_, "of");
  channel.applied = text_attribute(dataset_, "applied");
  channel.from = text_attribute(dataset_, "from");
  const ChannelInfo* info = known_channel(name_);
  if (info == nullptr) {
    if (channel.type == TOFGRAPH_TYPE_ANY || channel.extent.size() < 2) return std::nullopt;
    return channel;
  }
  const std::vector<hsize_t> extent = expected_extent(*info, header);
  const std::vector<std::uint32_t> types = expected_types(*info);
  const bool same_extent = std::ranges::equal(channel.extent, extent, [](std::uint64_t found, hsize_t wanted) {
    return wanted == 0 ? found >= physics::min_exposures && found <= physics::max_exposures : found == wanted;
  });
  if (!same_extent || std::ranges::find(types, channel.type) == types.end())
    fail(fmt::format("is {}, expected {} x {} {}: the capture is of {} x {} px (width x height)", described(), size_[0],
                     shown(extent), names_of(types), header.width, header.height));
  if (!channel.unit.empty() && channel.unit != info->unit)
    fail(fmt::format("is in {}, expected {}", channel.unit, *info->unit != 0 ? info->unit : "no unit"));
  channel.unit = info->unit;
  if (channel.type == TOFGRAPH_TYPE_U8) channel.type = TOFGRAPH_TYPE_U16;  // flags: HDF5 converts when reading
  return channel;
}

void Dataset::check_metadata(const layout::Metadata& kind) const {
  const H5T_class_t found = H5Tget_class(type_), wanted = H5Tget_class(kind.file_type());
  const char* name = wanted == H5T_INTEGER ? "whole numbers" : "floating-point numbers";
  if (size_.size() != 1 || found != wanted) fail(fmt::format("is {}, expected one of N {}", described(), name));
}

std::string Dataset::text() const {
  if (size_.size() != 1 || element_type_of(type_) != TOFGRAPH_TYPE_U8 || size_[0] > longest_text)
    fail(fmt::format("is {}, expected the bytes of a text, at most {}", described(), longest_text));
  std::string text(frames(), '\0');
  for (hsize_t i = 0; !chunk_.empty() && i < size_[0]; i += chunk_[0]) check_chunk(i);
  read_first(frames(), H5T_NATIVE_CHAR, text.data());
  return text;
}

void Dataset::read(hsize_t first, hsize_t frames, hid_t frames_space, hid_t memory, void* data) const {
  std::vector<hsize_t> start(size_.size(), 0), count = size_;
  start[0] = first;
  count[0] = frames;
  check(H5Sselect_hyperslab(space_, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr), "cannot be read");
  check(H5Dread(dataset_, memory, frames_space, space_, H5P_DEFAULT, data), "cannot be read");
}

void Dataset::read_first(std::size_t frames, hid_t memory, void* data) const {
  if (frames == 0) return;
  std::vector<hsize_t> size = size_;
  size[0] = frames;
  const Handle space(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose);
  try {
    read(0, frames, space, memory, data);
  } catch (const std::exception& problem) {
    fail(problem.what());
  }
}

/// Guards against a damaged index, which can announce chunks of any size that HDF5 would then allocate.
/// @returns true if the chunk is stored as it is, without compression
bool Dataset::check_chunk(hsize_t frame) const {
  if (chunk_.empty()) return false;
  std::vector<hsize_t> offset(size_.size(), 0);
  offset[0] = frame / chunk_[0] * chunk_[0];
  hsize_t stored = 0;
  // Unlike H5Dget_chunk_info_by_coord this does not scan all chunks.
  check(H5Dget_chunk_storage_size(dataset_, offset.data(), &stored), "cannot be found");
  const std::uint64_t plain = product(product(chunk_, 0), H5Tget_size(type_));
  const std::uint64_t most = plain + plain / 8 + 4096;  // upper bound of deflate's expansion
  if (stored > most) throw std::runtime_error(fmt::format("announces {} bytes for {}", stored, plain));
  return stored == plain && !filtered_;
}

void Dataset::read_range(std::uint64_t first, std::uint64_t count, hid_t memory, void* data) const {
  std::vector<hsize_t> size = size_;
  size[0] = count;
  const Handle space(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose);
  try {
    for (std::uint64_t at = first; !chunk_.empty() && at < first + count; at += chunk_[0]) check_chunk(at);
    read(first, count, space, memory, data);
  } catch (const std::exception& problem) {
    fail(problem.what());
  }
}

void Dataset::read_frame(std::size_t frame, hid_t memory, void* data) const {
  if (check_chunk(frame) && is_frame_ && H5Tequal(type_, memory) > 0) {  // not by way of HDF5's cache
    std::vector<hsize_t> offset(size_.size(), 0);
    offset[0] = frame;
    std::uint32_t left_out = 0;
    check(H5Dread_chunk(dataset_, H5P_DEFAULT, offset.data(), &left_out, data), "cannot be read");
    return;
  }
  read(frame, 1, frame_space_, memory, data);
}

}  // namespace tofgraph::io::h5
