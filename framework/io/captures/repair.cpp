// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/repair.hpp"

#include "io/captures/capture.hpp"
#include "io/output_file.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace tofgraph::io {
namespace fs = std::filesystem;
namespace {

/// One frame in memory, with the views that a writer takes.
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

/// Removed unless the capture has got its name: it is a copy, nothing is lost with it.
struct Temporary {
  fs::path path;
  explicit Temporary(const fs::path& file)
      : path(file.parent_path() / fmt::format(".{}.{}.part", file.filename().string(), getpid())) {}
  ~Temporary() {
    std::error_code error;
    fs::remove(path, error);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
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
  const CaptureReader reader(part);
  if (const std::string problem = input_problem(file, std::span(&part, 1)); !problem.empty())
    throw std::runtime_error(problem);
  const Temporary temporary(file);
  CaptureWriter writer(file, reader.header(), reader.channels(), {0, overwrite, temporary.path});
  Images images(reader.channels());
  Repaired result;
  std::uint64_t before = 0;
  for (; result.frames < reader.frames(); ++result.frames) {
    const tofgraph_metadata metadata = reader.metadata(result.frames);
    if (result.frames != 0) result.missing += frames_between(before, metadata.device_number);
    before = metadata.device_number;
    writer.append(metadata, images.read(reader, result.frames));
    if (frame_done) frame_done(result.frames + 1, reader.frames());
  }
  writer.finish();
  return result;
}

}  // namespace tofgraph::io
