// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_hdf5.hpp"

#include <tofgraph/plugin.h>

#include <fmt/format.h>

#include <cstdio>
#include <string_view>
#include <utility>

namespace tofgraph::io::h5 {
namespace {

std::mutex& mutex() {
  static std::mutex instance;
  return instance;
}

herr_t keep_description(unsigned, const H5E_error2_t* error, void* text) {
  if (error->desc != nullptr && *error->desc != 0) *static_cast<std::string*>(text) = error->desc;
  return 1;  // the walk starts at the innermost
}

/// @param words error text of HDF5 1.10
Failure explained(const std::string& words) {
  const auto says = [&words](std::string_view part) { return words.find(part) != std::string::npos; };
  unsigned long long left = 0, whole = 0;
  if (std::sscanf(words.c_str(), "truncated file: eof = %llu, sblock->base_addr = %*u, stored_eof = %llu", &left,
                  &whole) == 2)
    return {.text = fmt::format(
                "it was cut off: it has {} of {} bytes; 'tofgraph repair' keeps the whole frames of a capture", left,
                whole)};
  if (says("already open for"))
    return {.text = "it is marked as open for writing: by a program that runs, or that was killed",
            .being_written = true};
  if (says("unable to lock file") && says("errno = 11,")) return {.text = "another program has it open"};
  constexpr std::string_view system = "error message = '";
  if (const std::size_t at = words.find(system); at != std::string::npos) {
    const std::size_t begin = at + system.size();
    return {.text = words.substr(begin, words.find('\'', begin) - begin)};
  }
  if (says("allocation failed")) return {.text = "it asks for more memory than is allowed"};
  return {.text = "HDF5 cannot read it"};
}

}  // namespace

Lock::Lock() : lock_(mutex()) {
  // Errors are thrown as exceptions. A thread-safe HDF5 would also print them once per thread.
  thread_local const bool silenced = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
  static_cast<void>(silenced);
}

Failure last_failure() {
  std::string words;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_description, &words);
  H5Eclear2(H5E_DEFAULT);
  return explained(words);
}

std::string missing_filter(hid_t dataset) {
  // Names from the registry of the HDF Group, for files that do not state them.
  static constexpr std::pair<H5Z_filter_t, const char*> known[] = {
      {H5Z_FILTER_SZIP, "szip"}, {307, "bzip2"}, {32000, "lzf"},  {32001, "blosc"}, {32004, "lz4"},
      {32008, "bitshuffle"},     {32013, "zfp"}, {32015, "zstd"}, {32017, "sz"},    {32026, "blosc2"},
  };
  const Handle creation(check(H5Dget_create_plist(dataset), "the filters cannot be read"), H5Pclose);
  const int count = check(H5Pget_nfilters(creation), "the filters cannot be read");
  for (int i = 0; i < count; ++i) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    char name[64] = "";
    const H5Z_filter_t filter =
        check(H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values, nullptr, sizeof name, name, &config),
              "the filters cannot be read");
    const bool there = H5Zfilter_avail(filter) > 0;
    const bool decodes =
        there && (H5Zget_filter_info(filter, &config) < 0 || (config & H5Z_FILTER_CONFIG_DECODE_ENABLED) != 0);
    H5Eclear2(H5E_DEFAULT);
    if (decodes) continue;
    std::string shown = std::string(name).substr(0, std::string_view(name).find(' '));
    for (const auto& [number, usual] : known)
      if (number == filter) shown = usual;
    return fmt::format(
        "is compressed with the filter '{}' (number {}), which is not installed: h5repack -f GZIP=4 IN.h5 OUT.h5 where "
        "it is, or h5py with compression='gzip', make a file that can be read",
        shown.empty() ? "unknown" : shown, filter);
  }
  return {};
}

hid_t memory_type(std::uint32_t element_type) {
  switch (element_type) {
    case TOFGRAPH_TYPE_F32:
      return H5T_NATIVE_FLOAT;
    case TOFGRAPH_TYPE_F64:
      return H5T_NATIVE_DOUBLE;
    case TOFGRAPH_TYPE_U8:
      return H5T_NATIVE_UINT8;
    case TOFGRAPH_TYPE_U16:
      return H5T_NATIVE_UINT16;
    case TOFGRAPH_TYPE_I16:
      return H5T_NATIVE_INT16;
    case TOFGRAPH_TYPE_I32:
      return H5T_NATIVE_INT32;
    default:
      throw std::invalid_argument("an element type that captures do not hold");
  }
}

std::uint32_t element_type_of(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      return size == 4 ? TOFGRAPH_TYPE_F32 : size == 8 ? TOFGRAPH_TYPE_F64 : TOFGRAPH_TYPE_ANY;
    case H5T_INTEGER:
      if (H5Tget_sign(type) == H5T_SGN_NONE)
        return size == 1 ? TOFGRAPH_TYPE_U8 : size == 2 ? TOFGRAPH_TYPE_U16 : TOFGRAPH_TYPE_ANY;
      return size == 2 ? TOFGRAPH_TYPE_I16 : size == 4 ? TOFGRAPH_TYPE_I32 : TOFGRAPH_TYPE_ANY;
    default:
      return TOFGRAPH_TYPE_ANY;
  }
}

}  // namespace tofgraph::io::h5
