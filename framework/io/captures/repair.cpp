// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/repair.hpp"

#include "io/captures/capture.hpp"
#include "io/captures/capture_layout.hpp"
#include "io/output_file.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace tofgraph::io {
namespace fs = std::filesystem;
namespace {

/// Frame in memory, with the views for a writer.
class Images {
 public:
  explicit Images(const std::vector<CaptureChannel>& channels) {
    for (const CaptureChannel& channel : channels) data_.emplace_back(channel.bytes());
    for (std::size_t i = 0; i < channels.size(); ++i) views_.push_back(view(channels[i], data_[i]));
  }
  const std::vector<tofgraph_view>& read(const CaptureReader& reader, std::size_t frame) {
    for (std::size_t i = 0; i < data_.size(); ++i) reader.read(i, frame, data_[i].data());
    return views_;
  }

 private:
  static tofgraph_view view(const CaptureChannel& channel, std::vector<std::byte>& data) {
    tofgraph_view result{};
    result.data = data.data();
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    auto stride = static_cast<std::int64_t>(element_size(channel.type));
    for (std::size_t i = channel.extent.size(); i-- > 0;) {
      result.extent[i] = channel.extent[i];
      result.stride[i] = stride;
      stride *= static_cast<std::int64_t>(channel.extent[i]);
    }
    return result;
  }

  std::vector<std::vector<std::byte>> data_;
  std::vector<tofgraph_view> views_;
};

/// Removes the copy unless it was renamed to the capture; nothing is lost with it.
struct Temporary {
  fs::path path;
  Temporary(const fs::path& file, const char* ending)
      : path(file.parent_path() / fmt::format(".{}.{}.{}", file.filename().string(), getpid(), ending)) {}
  ~Temporary() {
    std::error_code error;
    fs::remove(path, error);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
};

/// File size according to its HDF5 superblock; 0: there is none.
std::uint64_t announced_size(const fs::path& file) {
  constexpr unsigned char signature[] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
  std::array<unsigned char, 64> head{};
  std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(head.data()), head.size());
  if (!std::equal(std::begin(signature), std::end(signature), head.begin())) return 0;
  // Offsets of the end-of-file address and of the address size, by superblock version.
  constexpr std::size_t end_at[] = {40, 44, 28, 28}, size_at[] = {13, 13, 9, 9};
  const std::size_t version = head[8];
  if (version >= std::size(end_at) || head[size_at[version]] != 8) return 0;
  std::uint64_t size = 0;
  for (std::size_t i = 8; i-- > 0;) size = size << 8U | head[end_at[version] + i];
  return size;
}

/// Reader of a recording; a truncated file is read from a copy that is extended with zeros.
struct RepairSource {
  std::unique_ptr<CaptureReader> reader;
  bool cut = false;

  RepairSource(const fs::path& part, const Temporary& copy) {
    const std::uint64_t size = fs::is_regular_file(part) ? fs::file_size(part) : 0, whole = announced_size(part);
    constexpr std::uint64_t max_frame = std::uint64_t{1} << 40U;  // a damaged superblock may announce any size
    try {
      reader = std::make_unique<CaptureReader>(part);
    } catch (const std::runtime_error&) {
      if (whole <= size || whole - size > max_frame) throw;
      fs::copy_file(part, copy.path);
      fs::resize_file(copy.path, whole);
      try {
        reader = std::make_unique<CaptureReader>(copy.path, size);
      } catch (const std::runtime_error& problem) {
        std::string why = problem.what();
        if (const std::string name = copy.path.string() + ": "; why.starts_with(name)) why.erase(0, name.size());
        throw std::runtime_error(fmt::format(
            "{} was cut off: it has {} of {} bytes, and {}", part.string(), size, whole,
            why == layout::no_complete_frame ? "no whole frame is in them" : "they cannot be read: " + why));
      }
      cut = true;
    }
  }
};

}  // namespace

std::size_t frames_between(std::uint64_t before, std::uint64_t after) {
  return after > before ? static_cast<std::size_t>(after - before - 1) : 0;
}

Repaired repair_capture(const fs::path& part, const fs::path& file, bool overwrite,
                        const std::function<void(std::size_t, std::size_t)>& frame_done) {
  if (CaptureWriter::is_at_work(part))
    throw std::runtime_error(
        fmt::format("{} is still being recorded: it gets its name when the recorder ends, and can be read meanwhile",
                    part.string()));
  if (const std::string problem = input_problem(file, std::span(&part, 1)); !problem.empty())
    throw std::runtime_error(problem);
  const Temporary temporary(file, "part"), copy(file, "copy");
  const RepairSource source(part, copy);
  const CaptureReader& reader = *source.reader;
  CaptureWriter writer(file, reader.header(), reader.channels(), {0, overwrite, temporary.path});
  Images images(reader.channels());
  Repaired result;
  std::uint64_t before = 0;
  for (; result.frames < reader.frames(); ++result.frames) {
    const tofgraph_metadata metadata = reader.metadata(result.frames);
    if (result.frames != 0) result.missing += frames_between(before, metadata.device_number);
    before = metadata.device_number;
    try {
      writer.append(metadata, images.read(reader, result.frames));
    } catch (const std::runtime_error&) {
      if (!source.cut || result.frames == 0) throw;
      break;  // its chunk exists but is damaged
    }
    if (frame_done) frame_done(result.frames + 1, reader.frames());
  }
  writer.finish();
  result.cut = source.cut;
  if (source.cut) {
    result.lost = reader.announced_frames() - result.frames;
    for (std::size_t i = 0; i < result.frames; ++i)
      result.without_time += (reader.known(i, i) & TOFGRAPH_KNOWS_TIMESTAMP) == 0 ? 1 : 0;
  }
  return result;
}

}  // namespace tofgraph::io
