// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Datasets that grow while a capture is written. Internal to this folder; the caller holds the lock.
#pragma once

#include "io/captures/capture_hdf5.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::io::h5 {

/// Text that is known only after the file was opened for readers: from then on only rows of datasets can be added.
class LateText {
 public:
  LateText() = default;
  LateText(hid_t file, const char* name) {
    const hsize_t none = 0, any = H5S_UNLIMITED, chunk = 16384;
    const Handle space(H5Screate_simple(1, &none, &any), H5Sclose);
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(creation, false);  // for reproducible files
    check(H5Pset_chunk(creation, 1, &chunk), name);
    dataset_ =
        Handle(check(H5Dcreate2(file, name, H5T_STD_U8LE, space, H5P_DEFAULT, creation, H5P_DEFAULT), name), H5Dclose);
  }
  void write(const std::string& text) const {
    const hsize_t size = text.size();
    check(H5Dset_extent(dataset_, &size), "cannot grow");
    check(H5Dwrite(dataset_, H5T_NATIVE_CHAR, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()), "cannot be written");
  }
  void close() { dataset_.reset(); }
  explicit operator bool() const { return static_cast<bool>(dataset_); }

 private:
  Handle dataset_;
};

/// Dataset that grows by one frame at a time.
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
    H5Pset_obj_track_times(creation, false);  // for reproducible files
    check(H5Pset_chunk(creation, rank, chunk.data()), "the chunks of " + name);
    if (compression > 0) {
      check(H5Pset_shuffle(creation), "byte shuffling");
      check(H5Pset_deflate(creation, static_cast<unsigned>(compression)), "compression");
    }
    const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
    // A chunk that is a complete frame is written to the file directly.
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

}  // namespace tofgraph::io::h5
