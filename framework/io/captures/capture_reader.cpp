// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/log.hpp"
#include "config/paths.hpp"
#include "config/process_limits.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/captures/capture_layout.hpp"
#include "io/captures/capture_metadata.hpp"
#include "io/light_sources.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::io {
namespace fs = std::filesystem;
using h5::check;
using h5::Dataset;
using h5::Handle;

namespace {

constexpr std::int64_t max_side = 16384;  // px
constexpr std::size_t max_datasets = 256;

// Resource limits for opening a capture.
constexpr std::size_t trial_memory = 128U << 20U;  // bytes; twice the file size is added
constexpr std::size_t max_chunk = 512U << 20U;     // bytes; maximum of the file size in this sum
constexpr unsigned trial_seconds = 10;             // of CPU time

/// Channels of which a capture needs at least one.
constexpr const char* measurements[] = {"taps",  "phases",    "distance",  "range",
                                        "depth", "amplitude", "intensity", "points"};

std::string shown(const std::vector<std::string>& names) {
  return names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "));
}

/// Names of the datasets in the group; links to other files and other objects are skipped.
std::vector<std::string> names_in(hid_t group) {
  H5G_info_t info{};
  check(H5Gget_info(group, &info), "the group /frames");
  if (info.nlinks > max_datasets)
    throw std::runtime_error(
        fmt::format("/frames announces {} datasets, at most {} are read", info.nlinks, max_datasets));
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5L_info_t* link, void* list) {
    if (link->type == H5L_TYPE_HARD) static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return herr_t{0};
  };
  check(H5Literate(group, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, visit, &names), "the group /frames cannot be listed");
  std::erase_if(names, [&](const std::string& name) {
    const Handle object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
    return !object || H5Iget_type(object) != H5I_DATASET;
  });
  std::ranges::sort(names);
  return names;
}

/// @throws std::runtime_error if the path does not name a regular file with content
void check_file(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) {
    if (fs::exists(file.string() + ".part", error))
      throw std::runtime_error(
          fmt::format("does not exist, but {}.part does: a recording that is still running or was cut off; "
                      "it can be read under that name",
                      file.filename().string()));
    throw std::runtime_error("there is no such file");
  }
  if (!fs::is_regular_file(file, error)) throw std::runtime_error("is not a file");
  if (fs::file_size(file, error) == 0 && !error) throw std::runtime_error("is empty");
}

}  // namespace

struct CaptureReader::Impl {
  fs::path file;
  bool finished = true;
  Handle h5, group;
  CaptureHeader header;
  std::vector<CaptureChannel> channels;
  std::vector<Dataset> datasets;  // of the channels
  std::vector<h5::MetadataArray> metadata;
  std::vector<std::string> ignored;
  std::size_t frames = 0, announced = 0;
  std::uint64_t end = not_cut;  // length of a truncated file in bytes

  bool is_cut() const { return end != not_cut; }
  void load();
  void try_frames() const;
  void open();
  void read_header();
  void read_exposures();
  void read_channels();
  void add_channel(Dataset dataset);
  void add_unknown(const std::string& name);
  void read_metadata();
  void read_array(const layout::Metadata& kind);
  void settle_frames(const Dataset& dataset);
  std::int64_t side(const char* name) const;
};

CaptureReader::CaptureReader(const fs::path& file) : CaptureReader(file, not_cut) {}

CaptureReader::CaptureReader(const fs::path& file, std::uint64_t end) {
  try {
    check_file(file);
    run_trial_once(file, end == not_cut ? capture_trial : fmt::format("{} up to {}", capture_trial, end),
                   {config::trial_program(), "capture", file.string(), std::to_string(end)});
    const h5::Lock lock;
    auto impl = std::make_unique<Impl>();  // local, so that a failure closes the file with the lock held
    impl->file = file;
    impl->end = end;
    impl->load();
    impl_ = std::move(impl);
  } catch (const std::exception& problem) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), problem.what()));
  }
}

void CaptureReader::read_on_trial(const fs::path& file, std::uint64_t end) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  config::limit_process({trial_memory + 2 * std::min<std::size_t>(error ? 0 : size, max_chunk), trial_seconds});
  Impl trial;
  trial.file = file;
  trial.end = end;
  trial.load();
  trial.try_frames();
}

void CaptureReader::Impl::load() {
  open();
  read_header();
  read_channels();
  read_metadata();
}

/// Reads the first and the last frame of each channel, which provokes any failure inside HDF5.
void CaptureReader::Impl::try_frames() const {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    std::vector<std::byte> frame(channels[i].bytes());
    for (const std::size_t number : {std::size_t{0}, frames - 1})
      datasets[i].read_frame(number, h5::memory_type(channels[i].type), frame.data());
  }
}

CaptureReader::~CaptureReader() {
  const h5::Lock lock;
  impl_.reset();
}

void CaptureReader::Impl::open() {
  if (H5Fis_hdf5(file.c_str()) <= 0) {
    H5Eclear2(H5E_DEFAULT);
    throw std::runtime_error("is not an HDF5 file, or cannot be opened");
  }
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(H5Pset_file_locking(access, true, true), "file locking");
  finished = file.extension() != ".part" && !is_cut();
  h5 = Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
  if (h5) return;
  h5::Failure why = h5::last_failure();
  // A recording in progress or whose recorder was killed is marked: it can be read up to its last flush.
  if (why.being_written) {
    check(H5Pset_metadata_read_attempts(access, 10), "reading while it is written");
    h5 = Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access), H5Fclose);
    if (!h5) why = h5::last_failure();
    finished = false;
  }
  if (!h5) throw std::runtime_error("cannot be opened as HDF5: " + why.text);
}

std::int64_t CaptureReader::Impl::side(const char* name) const {
  const std::int64_t value = h5::integer_attribute(h5, name);
  if (value >= 1 && value <= max_side) return value;
  throw std::runtime_error(fmt::format("{} is {} px, expected 1 to {}", name, value, max_side));
}

void CaptureReader::Impl::read_header() {
  if (h5::text_attribute(h5, "format") == "tofgraph-statistics")
    throw std::runtime_error(
        "holds statistics of a capture, which only diagnose and calibrations of boards read: give the campaign of "
        "captures");
  if (h5::text_attribute(h5, "format") != layout::format) {
    throw std::runtime_error(
        fmt::format("is HDF5, but not a capture: its attribute format is '{}', expected '{}'; "
                    "--as CHANNEL=DATASET or a layout says what its datasets are: tofgraph "
                    "convert --inspect FILE lists them",
                    h5::text_attribute(h5, "format"), layout::format));
  }
  const std::int64_t version = h5::integer_attribute(h5, "version");
  if (version > layout::version)
    throw std::runtime_error(
        fmt::format("was written by a newer tofgraph: it is a capture of version {}, this program reads version {}; "
                    "use the program that recorded it, or a newer one",
                    version, layout::version));
  if (version != layout::version)
    throw std::runtime_error(
        fmt::format("is a capture of version {}, this program reads version {}", version, layout::version));
  header.camera = h5::text_attribute(h5, "camera");
  if (header.camera.empty())
    throw std::runtime_error("has no attribute camera: the name of a profile, such as camcube2");
  header.width = static_cast<std::uint32_t>(side("width"));
  header.height = static_cast<std::uint32_t>(side("height"));
  header.comment = h5::text_attribute(h5, "comment");
  header.profile = h5::text_attribute(h5, "profile");
  header.serial = h5::text_attribute(h5, "serial");
  header.sources = names_between_commas(h5::text_attribute(h5, "sources"));
  header.provenance = h5::text_attribute(h5, layout::provenance);
  // Written last: after a kill it may be incomplete.
  if (finished && H5Lexists(h5, layout::provenance, H5P_DEFAULT) > 0)
    header.provenance = Dataset(h5, layout::provenance).text();
  read_exposures();
}

void CaptureReader::Impl::read_exposures() {
  const std::vector<double> phases = h5::numbers_attribute(h5, layout::phase, physics::max_exposures);
  const std::vector<double> frequencies = h5::numbers_attribute(h5, layout::frequency, physics::max_exposures);
  if (phases.empty() && frequencies.empty()) return;
  if (phases.empty() || (!frequencies.empty() && frequencies.size() != phases.size())) {
    throw std::runtime_error(fmt::format("attribute {} has {} values, but {} has {}: expected the same number",
                                         layout::phase, phases.size(), layout::frequency, frequencies.size()));
  }
  for (std::size_t k = 0; k < phases.size(); ++k)
    header.exposures.push_back({phases[k], frequencies.empty() ? 0 : frequencies[k]});
  if (const std::string problem = physics::exposures_problem(header.exposures); !problem.empty())
    throw std::runtime_error(fmt::format("attributes {} and {}: {}", layout::phase, layout::frequency, problem));
}

void CaptureReader::Impl::read_channels() {
  group = Handle(H5Gopen2(h5, layout::group, H5P_DEFAULT), H5Gclose);
  const std::string why = group ? "" : h5::last_error();
  if (!group && H5Lexists(h5, layout::group, H5P_DEFAULT) == 0) {
    H5Eclear2(H5E_DEFAULT);
    throw std::runtime_error("has no group /frames");
  }
  if (!group) throw std::runtime_error("the group /frames cannot be opened: " + why);
  const std::vector<std::string> names = names_in(group);
  const bool measured =
      std::ranges::any_of(measurements, [&](const char* m) { return std::ranges::count(names, m) > 0; });
  if (!measured) {
    throw std::runtime_error(
        fmt::format("/frames holds {}: at least one of {} is expected", shown(names), fmt::join(measurements, ", ")));
  }
  frames = std::numeric_limits<std::size_t>::max();
  for (const std::string& name : names) {
    if (known_channel(name) != nullptr) add_channel(Dataset(group, name, end));
  }
  for (const std::string& name : names) {
    if (known_channel(name) == nullptr && h5::metadata_kind(name) == nullptr) add_unknown(name);
  }
}

void CaptureReader::Impl::add_channel(Dataset dataset) {
  CaptureChannel channel = dataset.as_channel(header).value();
  for (const CaptureChannel& other : channels) {
    const bool both_raw =
        (other.name == "taps" && channel.name == "phases") || (other.name == "phases" && channel.name == "taps");
    if (both_raw && other.extent[0] != channel.extent[0])
      throw std::runtime_error(fmt::format("/frames/{} has {} exposures, but /frames/{} has {}", channel.name,
                                           channel.extent[0], other.name, other.extent[0]));
  }
  settle_frames(dataset);
  channels.push_back(std::move(channel));
  datasets.push_back(std::move(dataset));
}

/// Datasets with other names are channels of stages unknown to this program, or unrelated.
void CaptureReader::Impl::add_unknown(const std::string& name) {
  try {
    Dataset dataset(group, name, end);
    const bool same_number = finished ? dataset.frames() == frames : dataset.frames() > 0;
    if (dataset.as_channel(header) && same_number) return add_channel(std::move(dataset));
  } catch (const std::exception&) {  // not an error of the capture
  }
  ignored.push_back(name);
}

/// All datasets contain the same number of frames; in a recording that was cut off only frames present in all count.
void CaptureReader::Impl::settle_frames(const Dataset& dataset) {
  const std::size_t stored = dataset.stored_frames(finished);
  const bool first = frames == std::numeric_limits<std::size_t>::max();
  if (finished && !first && stored != frames) {
    throw std::runtime_error(fmt::format("/frames/{} has {}, but /frames/{} has {}", dataset.name(),
                                         config::counted(stored, "frame"),
                                         channels.empty() ? "" : channels.front().name, frames));
  }
  frames = std::min(frames, stored);
  announced = std::max(announced, dataset.frames());
}

void CaptureReader::Impl::read_metadata() {
  for (const layout::Metadata& kind : layout::metadata) {
    if (is_cut())
      metadata.push_back(h5::read_cut_array(group, kind, frames, end));
    else
      read_array(kind);
  }
  for (h5::MetadataArray& array : metadata) array.values.resize(frames);
  if (frames == 0) throw std::runtime_error(finished ? "holds no frames" : layout::no_complete_frame);
}

void CaptureReader::Impl::read_array(const layout::Metadata& kind) {
  if (H5Lexists(group, kind.name, H5P_DEFAULT) <= 0) {
    H5Eclear2(H5E_DEFAULT);
    if (!kind.required) return;
    throw std::runtime_error(
        fmt::format("has no /frames/{}: {} values are expected, {}", kind.name, frames,
                    kind.known == TOFGRAPH_KNOWS_TIMESTAMP ? "0 where it is unknown" : "NaN where it is unknown"));
  }
  Dataset dataset(group, kind.name);
  dataset.check_metadata(kind);
  settle_frames(dataset);
  h5::MetadataArray array{&kind, std::vector<layout::Element>(frames)};
  dataset.read_first(frames, kind.memory_type(), array.values.data());
  metadata.push_back(std::move(array));
}

const CaptureHeader& CaptureReader::header() const { return impl_->header; }
std::size_t CaptureReader::frames() const { return impl_->frames; }
std::size_t CaptureReader::announced_frames() const { return impl_->announced; }
bool CaptureReader::finished() const { return impl_->finished; }
const std::vector<CaptureChannel>& CaptureReader::channels() const { return impl_->channels; }
const std::vector<std::string>& CaptureReader::ignored() const { return impl_->ignored; }

tofgraph_metadata CaptureReader::metadata(std::size_t frame) const {
  tofgraph_metadata result{};
  result.size = sizeof result;
  result.device_number = frame;
  for (const h5::MetadataArray& array : impl_->metadata) array.kind->load(result, array.values.at(frame));
  return result;
}

bool CaptureReader::has_frame_numbers() const {
  return std::ranges::any_of(impl_->metadata, [](const h5::MetadataArray& array) {
    return array.kind->name == std::string_view("frame_number");
  });
}

std::uint64_t CaptureReader::known(std::size_t first, std::size_t last) const {
  std::uint64_t bits = 0;
  for (const h5::MetadataArray& array : impl_->metadata) {
    if (array.kind->known != 0 && array.knows(first, last)) bits |= array.kind->known;
  }
  return bits;
}

void CaptureReader::read(std::size_t channel, std::size_t frame, void* data) const {
  const h5::Lock lock;
  try {
    impl_->datasets.at(channel).read_frame(frame, h5::memory_type(impl_->channels[channel].type), data);
  } catch (const std::exception& problem) {
    throw std::runtime_error(fmt::format("{}: frame {} of {}: {}", impl_->file.string(), frame,
                                         impl_->channels.at(channel).name, problem.what()));
  }
}

}  // namespace tofgraph::io
