// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/statistics_file.hpp"

#include "io/captures/capture_dataset.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <zlib.h>

#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

namespace tofgraph::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t block = 512;  ///< bytes before HDF5's, which HDF5 ignores ("user block")
constexpr std::string_view magic = "tofgraph-statistics ";
constexpr int layout_version = 1;  ///< of the attributes and datasets
constexpr int compression = 4;

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  if (!stream || !(bytes << stream.rdbuf())) throw std::runtime_error(file.string() + ": cannot be read");
  return std::move(bytes).str();
}

std::string first_block(std::string_view rest) {
  std::string text = fmt::format("{}{} sha256 {}\n", magic, statistics_version, sha256_of(rest));
  text.resize(block, '\0');
  return text;
}

/// Checks the first block. @throws std::runtime_error
void check_bytes(const fs::path& file) {
  const std::string bytes = bytes_of(file);
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
  };
  const std::string_view view = bytes;
  if (!view.starts_with(magic)) fail("is not a statistics file, or is damaged at its beginning");
  const int version = std::atoi(bytes.c_str() + magic.size());
  if (version != statistics_version)
    fail(fmt::format("is of version {} of the statistics, this program reads version {}: reduce the captures again",
                     version, statistics_version));
  if (bytes.size() <= block || view.substr(0, block) != first_block(view.substr(block)))
    fail("is damaged: its content does not have the SHA-256 that it states; `tofgraph reduce` makes it again");
}

/// Numeric values of the header, in this order.
std::vector<double> numbers_of(const StatisticsHeader& h, const PixelSums& sums) {
  const CaptureFacts& f = h.facts;
  return {static_cast<double>(h.frames[0]), static_cast<double>(h.frames[1]),
          static_cast<double>(sums.frames), static_cast<double>(f.frames),
          static_cast<double>(f.exposures), f.first.integration_time,
          f.first.modulation_frequency,     f.first.temperature,
          f.first.time_since_power_on,      sums.limit};
}
constexpr std::size_t numbers = 10;

// HDF5 filters datasets under its lock, one file at a time, so its filters are applied here: shuffle, which puts the
// first bytes of all values first, and deflate.

using Bytes = std::vector<unsigned char>;

template <class T> Bytes pack(const std::vector<T>& values) {
  static_assert(std::endian::native == std::endian::little);
  Bytes shuffled(values.size() * sizeof(T));
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::array<unsigned char, sizeof(T)> value{};
    std::memcpy(value.data(), &values[i], sizeof(T));
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) shuffled[byte * values.size() + i] = value[byte];
  }
  uLongf bytes = compressBound(shuffled.size());
  Bytes packed(bytes);
  if (compress2(packed.data(), &bytes, shuffled.data(), shuffled.size(), compression) != Z_OK)
    throw std::runtime_error("statistics cannot be compressed");
  packed.resize(bytes);
  return packed;
}

/// Reverses pack(). @param name of the dataset @param values of known size
template <class T> void unpack(const Bytes& packed, const char* name, std::vector<T>& values) {
  Bytes shuffled(values.size() * sizeof(T));
  uLongf bytes = shuffled.size();
  if (uncompress(shuffled.data(), &bytes, packed.data(), packed.size()) != Z_OK || bytes != shuffled.size())
    throw std::runtime_error(fmt::format("'{}' cannot be decompressed", name));
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::array<unsigned char, sizeof(T)> value{};
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) value[byte] = shuffled[byte * values.size() + i];
    std::memcpy(&values[i], value.data(), sizeof(T));
  }
}

/// Datasets of the sums, see pack().
struct Packed {
  Bytes sum, square, intensity, bad;
};

void write_chunk(hid_t file, const char* name, hid_t stored, const Bytes& packed, std::size_t size) {
  const hsize_t extent = size, first = 0;
  const h5::Handle space(h5::check(H5Screate_simple(1, &extent, nullptr), name), H5Sclose);
  const h5::Handle creation(h5::check(H5Pcreate(H5P_DATASET_CREATE), name), H5Pclose);
  H5Pset_chunk(creation, 1, &extent);
  H5Pset_shuffle(creation);
  H5Pset_deflate(creation, compression);
  H5Pset_obj_track_times(creation, false);
  const h5::Handle set(h5::check(H5Dcreate2(file, name, stored, space, H5P_DEFAULT, creation, H5P_DEFAULT), name),
                       H5Dclose);
  h5::check(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &first, packed.size(), packed.data()), name);
}

Bytes read_chunk(hid_t file, const char* name, std::size_t size) {
  const h5::Handle set(h5::check(H5Dopen2(file, name, H5P_DEFAULT), name), H5Dclose);
  const h5::Handle space(h5::check(H5Dget_space(set), name), H5Sclose);
  if (H5Sget_simple_extent_npoints(space) != static_cast<hssize_t>(size))
    throw std::runtime_error(fmt::format("'{}' has another size than its camera", name));
  const hsize_t first = 0;
  hsize_t bytes = 0;
  h5::check(H5Dget_chunk_storage_size(set, &first, &bytes), name);
  Bytes chunk(bytes);
  std::uint32_t filters_left_out = 0;
  h5::check(H5Dread_chunk(set, H5P_DEFAULT, &first, &filters_left_out, chunk.data()), name);
  if (filters_left_out != 0) throw std::runtime_error(fmt::format("'{}' is not compressed as documented", name));
  return chunk;
}

/// Bytes of an HDF5 file built in memory, so that HDF5 never encounters a full disk, which can crash it.
std::string hdf5_image(const Statistics& s) {
  const Packed packed{pack(s.sums.sum), pack(s.sums.square), pack(s.sums.intensity), pack(s.sums.bad)};
  const h5::Lock lock;
  const h5::Handle access(h5::check(H5Pcreate(H5P_FILE_ACCESS), "statistics"), H5Pclose);
  h5::check(H5Pset_fapl_core(access, 1U << 20U, false), "statistics");
  const h5::Handle file(h5::check(H5Fcreate("statistics", H5F_ACC_TRUNC, H5P_DEFAULT, access), "statistics"), H5Fclose);
  const StatisticsHeader& h = s.header;
  const CaptureHeader& c = h.facts.header;
  h5::write_text(file, "format", "tofgraph-statistics");
  h5::write_numbers(file, "version", {layout_version});
  for (const auto& [name, text] : {std::pair{"key", h.key},
                                   {"camera", c.camera},
                                   {"settings", h.settings},
                                   {"capture", h.capture},
                                   {"capture_sha256", h.capture_sha256},
                                   {"kind", s.sums.kind},
                                   {"serial", c.serial},
                                   {"sources", fmt::format("{}", fmt::join(c.sources, "\n"))}})
    h5::write_text(file, name, text);
  h5::write_numbers(file, "size", {static_cast<double>(c.width), static_cast<double>(c.height)});
  h5::write_numbers(file, "numbers", numbers_of(h, s.sums));
  std::vector<double> exposures;
  for (const tofgraph_exposure& e : c.exposures) exposures.insert(exposures.end(), {e.phase, e.frequency});
  if (!exposures.empty()) h5::write_numbers(file, "exposures", exposures);
  write_chunk(file, "sum", H5T_IEEE_F64LE, packed.sum, s.sums.sum.size());
  write_chunk(file, "square", H5T_IEEE_F64LE, packed.square, s.sums.square.size());
  write_chunk(file, "intensity", H5T_IEEE_F64LE, packed.intensity, s.sums.intensity.size());
  write_chunk(file, "bad", H5T_STD_U8LE, packed.bad, s.sums.bad.size());
  h5::check(H5Fflush(file, H5F_SCOPE_LOCAL), "statistics");
  std::string image(static_cast<std::size_t>(h5::check(H5Fget_file_image(file, nullptr, 0), "statistics")), '\0');
  h5::check(H5Fget_file_image(file, image.data(), image.size()), "statistics");
  return image;
}

/// @param packed receives the datasets; null: only the header is read
Statistics read_hdf5(const fs::path& path, Packed* packed) {
  const h5::Lock lock;
  const h5::Handle file(h5::check(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), path), H5Fclose);
  Statistics s;
  StatisticsHeader& h = s.header;
  CaptureHeader& c = h.facts.header;
  h.key = h5::text_attribute(file, "key");
  h.settings = h5::text_attribute(file, "settings");
  h.capture = h5::text_attribute(file, "capture");
  h.capture_sha256 = h5::text_attribute(file, "capture_sha256");
  s.sums.kind = h5::text_attribute(file, "kind");
  c.camera = h5::text_attribute(file, "camera");
  c.serial = h5::text_attribute(file, "serial");
  std::istringstream sources(h5::text_attribute(file, "sources"));
  for (std::string line; std::getline(sources, line);) c.sources.push_back(line);
  const std::vector<double> size = h5::numbers_attribute(file, "size", 2);
  const std::vector<double> n = h5::numbers_attribute(file, "numbers", numbers);
  const std::vector<double> exposures = h5::numbers_attribute(file, "exposures", 1024);
  if (size.size() != 2 || n.size() != numbers) throw std::runtime_error(path.string() + ": attributes are missing");
  const auto whole = [](double value) { return static_cast<std::uint64_t>(value); };
  c.width = static_cast<std::uint32_t>(size[0]);
  c.height = static_cast<std::uint32_t>(size[1]);
  h.frames = {whole(n[0]), whole(n[1])};
  s.sums.frames = whole(n[2]);
  h.facts.frames = whole(n[3]);
  h.facts.exposures = whole(n[4]);
  h.facts.first.integration_time = n[5];
  h.facts.first.modulation_frequency = n[6];
  h.facts.first.temperature = n[7];
  h.facts.first.time_since_power_on = n[8];
  s.sums.limit = n[9];
  for (std::size_t k = 0; k + 1 < exposures.size(); k += 2) c.exposures.push_back({exposures[k], exposures[k + 1]});
  if (packed == nullptr) return s;
  const std::size_t pixels = std::size_t{c.width} * c.height;
  const std::size_t steps = h.facts.exposures > 0 ? h.facts.exposures : 4;  // decoded: stored as four phases
  s.sums.sum.resize(pixels * steps);
  s.sums.square.resize(pixels);
  s.sums.intensity.resize(pixels);
  s.sums.bad.resize(pixels);
  packed->sum = read_chunk(file, "sum", s.sums.sum.size());
  packed->square = read_chunk(file, "square", pixels);
  packed->intensity = read_chunk(file, "intensity", pixels);
  packed->bad = read_chunk(file, "bad", pixels);
  return s;
}

}  // namespace

bool is_statistics(const fs::path& file) { return file.extension() == statistics_extension; }

void write_statistics(const fs::path& file, const Statistics& statistics) {
  const std::string image = hdf5_image(statistics);
  OutputFile output(file);
  output.write(first_block(image));
  output.write(image);
  output.sync();
  output.commit();
}

Statistics read_statistics(const fs::path& file) {
  check_bytes(file);
  Packed packed;
  Statistics s = read_hdf5(file, &packed);
  unpack(packed.sum, "sum", s.sums.sum);
  unpack(packed.square, "square", s.sums.square);
  unpack(packed.intensity, "intensity", s.sums.intensity);
  unpack(packed.bad, "bad", s.sums.bad);
  return s;
}

StatisticsHeader read_statistics_header(const fs::path& file) {
  check_bytes(file);
  return read_hdf5(file, nullptr).header;
}

}  // namespace tofgraph::io
