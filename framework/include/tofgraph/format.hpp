// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// File formats of other programs: a class that opens a file, lists its arrays, and reads parts of them. The
/// meaning of the arrays (depth, unit, order of the axes) is stated by the user or by a layout, not by the
/// format.
///
///     struct Pgm final : tofgraph::FileFormat {
///       static constexpr const char* endings = "pgm";
///       static bool recognises(std::span<const std::uint8_t> head) { return head.size() > 2 && head[0] == 'P' .. ; }
///       explicit Pgm(const std::string& path) { add({.kind = .., .bytes = 2, .extent = {rows, columns}}); }
///       void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override { .. }
///     };
///     TOFGRAPH_FORMAT(Pgm, "Portable grey maps")
#pragma once

#include <tofgraph/file_format.hpp>

#include <cstring>
#include <memory>
#include <span>

#if !defined(TOFGRAPH_PLUGIN_NAME) || !defined(TOFGRAPH_PLUGIN_VERSION)
#error "TOFGRAPH_PLUGIN_NAME or TOFGRAPH_PLUGIN_VERSION is not defined: README.md beside plugin.h shows how"
#endif
#ifndef TOFGRAPH_PLUGIN_AUTHOR
#define TOFGRAPH_PLUGIN_AUTHOR ""
#endif
#ifndef TOFGRAPH_PLUGIN_LICENCE
#define TOFGRAPH_PLUGIN_LICENCE ""
#endif

namespace tofgraph {
namespace detail {

template <class T> struct __attribute__((visibility("hidden"))) FormatGlue {
  static int recognises(const std::uint8_t* head, std::uint64_t bytes) noexcept {
    return T::recognises(std::span(head, bytes)) ? 1 : 0;
  }

  template <class Call> static bool guarded(const tofgraph_format_host* host, Call&& call) noexcept {
    try {
      call();
      return true;
    } catch (const std::exception& error) {
      host->fail(host->context, error.what());
    } catch (...) {
      host->fail(host->context, "threw something that is not a std::exception");
    }
    return false;
  }

  static void* open(const char* path, const tofgraph_format_host* host) noexcept {
    std::unique_ptr<FileFormat> file;
    const bool opened = guarded(host, [&] {
      file = std::make_unique<T>(std::string(path));
      for (const FileArray& array : file->arrays()) {
        if (array.extent.empty() || array.extent.size() > 6) throw std::runtime_error("has an array of no rank 1 to 6");
        tofgraph_file_array made{};
        made.size = sizeof made;
        made.flags = array.reversed ? TOFGRAPH_ARRAY_REVERSED + 0U : 0U;
        made.kind = array.kind;
        made.bytes = array.bytes;
        made.rank = static_cast<std::uint32_t>(array.extent.size());
        std::memcpy(made.extent, array.extent.data(), array.extent.size() * sizeof(std::uint64_t));
        made.name = array.name.c_str();
        made.unit = array.unit.c_str();
        made.text = array.text.c_str();
        made.axes = array.axes.c_str();
        host->add(host->context, &made);
      }
      if (!file->profile().empty()) host->profile(host->context, file->profile().c_str());
    });
    return opened ? file.release() : nullptr;
  }

  static int read(void* file, std::uint64_t array, std::uint64_t first, std::uint64_t count, void* out,
                  const tofgraph_format_host* host) noexcept {
    FileFormat& opened = *static_cast<FileFormat*>(file);
    return guarded(host, [&] { opened.read(array, first, count, out); }) ? TOFGRAPH_STATUS_OK : TOFGRAPH_STATUS_ERROR;
  }
  static void close(void* file) noexcept { delete static_cast<FileFormat*>(file); }

  static const tofgraph_descriptor* descriptor(const char* summary) noexcept {
    static constexpr tofgraph_format format{sizeof(tofgraph_format), 0, T::endings, recognises, open, read, close};
    static constexpr tofgraph_extension extension{"format", 1, 0, &format};
    static const tofgraph_descriptor result = [&] {
      tofgraph_descriptor d{};
      d.size = sizeof d;
      d.api_major = TOFGRAPH_API_MAJOR;
      d.api_minor = TOFGRAPH_API_MINOR;
      d.kind = "format";
      d.name = TOFGRAPH_PLUGIN_NAME;
      d.summary = summary;
      d.version = TOFGRAPH_PLUGIN_VERSION;
      d.author = TOFGRAPH_PLUGIN_AUTHOR;
      d.licence = TOFGRAPH_PLUGIN_LICENCE;
      d.extension_size = sizeof(tofgraph_extension);
      d.extensions = &extension;
      d.extension_count = 1;
      return d;
    }();
    return &result;
  }
};

}  // namespace detail
}  // namespace tofgraph

/// Exports a format from its plugin. Use once per file.
#define TOFGRAPH_FORMAT(Class, summary)                                                                \
  extern "C" __attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void) { \
    return tofgraph::detail::FormatGlue<Class>::descriptor(summary);                                   \
  }
