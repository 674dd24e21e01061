// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/foreign_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>

namespace tofgraph::foreign {
namespace {

constexpr std::size_t head_bytes = 4096;
constexpr std::uint64_t max_array_bytes = std::uint64_t{1} << 50U;

/// Messages that a format plugin reports during one call.
struct Report {
  std::string problem, profile;
  std::vector<FileArray> arrays;
};

tofgraph_format_host host_of(Report& report) {
  tofgraph_format_host host{};
  host.size = sizeof host;
  host.context = &report;
  host.fail = [](void* context, const char* text) { static_cast<Report*>(context)->problem = text; };
  host.profile = [](void* context, const char* text) { static_cast<Report*>(context)->profile = text; };
  host.add = [](void* context, const tofgraph_file_array* array) {
    FileArray made;
    made.kind = array->kind;
    made.bytes = array->bytes;
    if (array->rank <= 6) made.extent.assign(array->extent, array->extent + array->rank);  // else check() rejects it
    made.name = array->name != nullptr ? array->name : "";
    made.unit = array->unit != nullptr ? array->unit : "";
    made.text = array->text != nullptr ? array->text : "";
    made.axes = array->axes != nullptr ? array->axes : "";
    made.reversed = (array->flags & TOFGRAPH_ARRAY_REVERSED) != 0;
    static_cast<Report*>(context)->arrays.push_back(std::move(made));
  };
  return host;
}

std::vector<std::uint8_t> head_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw ForeignError(fmt::format("{}: there is no such file", file.string()));
  std::ifstream in(file, std::ios::binary);
  std::vector<std::uint8_t> head(head_bytes);
  in.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  if (in.bad() || !in.is_open()) throw ForeignError(fmt::format("{}: cannot be read", file.string()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (head.empty()) throw ForeignError(fmt::format("{}: the file is empty", file.string()));
  return head;
}

void check(const std::filesystem::path& file, const std::string& format, const FileArray& array) {
  const bool sizes = array.bytes == 1 || array.bytes == 2 || array.bytes == 4 || array.bytes == 8;
  const bool kinds = array.kind >= TOFGRAPH_ELEMENT_SIGNED && array.kind <= TOFGRAPH_ELEMENT_FLOAT &&
                     (array.kind != TOFGRAPH_ELEMENT_FLOAT || array.bytes >= 4);
  std::uint64_t bytes = array.bytes;
  bool countable = true;
  for (const std::uint64_t e : array.extent) {
    countable = countable && (e == 0 || bytes <= max_array_bytes / e);
    bytes *= countable ? e : 1;
  }
  if (!countable)
    throw ForeignError(fmt::format("{}: the array '{}' states {} elements, more than a file can hold", file.string(),
                                   array.name, shape_text(array)));
  if (array.extent.empty() || !sizes || !kinds)
    throw ForeignError(
        fmt::format("{}: the format '{}' lists the array '{}' with elements or a rank that do "
                    "not exist: this is a bug in the plugin",
                    file.string(), format, array.name));
}

}  // namespace

Formats::Formats(const graph::PluginRegistry& registry) {
  std::vector<graph::PluginFile> files;
  for (const graph::PluginFile& plugin : registry.files()) {
    if (plugin.kind == "format") files.push_back(plugin);
  }
  const auto seen = registry.describe(files);
  for (const graph::PluginFile& plugin : files) {
    if (!seen.at(plugin.path.string()).contains("error")) formats_.push_back(&registry.load(plugin, seen));
  }
}

const graph::Plugin* Formats::find(const std::vector<std::uint8_t>& head) const {
  const auto found = std::ranges::find_if(
      formats_, [&](const graph::Plugin* one) { return one->format->recognises(head.data(), head.size()) != 0; });
  return found == formats_.end() ? nullptr : *found;
}

std::string Formats::endings() const {
  std::string text;
  for (const graph::Plugin* one : formats_) text += fmt::format("{}{}", text.empty() ? "" : ", ", one->format->endings);
  return text;
}

ForeignFile::ForeignFile(const Formats& formats, std::filesystem::path file) : path_(std::move(file)) {
  const graph::Plugin* plugin = formats.find(head_of(path_));
  if (plugin == nullptr)
    throw ForeignError(fmt::format(
        "{}: no format recognises the content of this file\n         formats: {}\n         a headerless file needs a "
        "layout, e.g. --layout raw.yaml; tofgraph list formats",
        path_.string(), formats.endings()));
  format_ = plugin->file.name;
  border_ = plugin->format;
  Report report;
  const tofgraph_format_host host = host_of(report);
  void* opened = border_->open(path_.c_str(), &host);
  if (opened == nullptr)
    throw ForeignError(
        fmt::format("{}: the file {}", path_.string(), report.problem.empty() ? "cannot be opened" : report.problem));
  file_ = std::shared_ptr<void>(opened, border_->close);
  arrays_ = std::move(report.arrays);
  profile_ = std::move(report.profile);
  for (const FileArray& array : arrays_) check(path_, format_, array);
}

ForeignFile::ForeignFile(std::filesystem::path file, std::shared_ptr<FileFormat> own)
    : path_(std::move(file)), format_("headerless"), own_(std::move(own)), arrays_(own_->arrays()) {}

std::size_t ForeignFile::find(const std::string& name) const {
  const auto found = std::ranges::find(arrays_, name, &FileArray::name);
  if (found != arrays_.end()) return static_cast<std::size_t>(found - arrays_.begin());
  std::vector<std::string> names;
  for (const FileArray& array : arrays_) names.push_back(array.name.empty() ? "(without a name)" : array.name);
  throw ForeignError(fmt::format("{}: has no array '{}'; it has: {}", path_.string(), name,
                                 names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

void ForeignFile::read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const {
  if (own_) {
    try {
      return own_->read(array, first, count, out);
    } catch (const std::runtime_error& error) {
      throw ForeignError(fmt::format("{}: the file {}", path_.string(), error.what()));
    }
  }
  Report report;
  const tofgraph_format_host host = host_of(report);
  if (border_->read(file_.get(), array, first, count, out, &host) == TOFGRAPH_STATUS_OK) return;
  throw ForeignError(
      fmt::format("{}: the file {}", path_.string(), report.problem.empty() ? "cannot be read" : report.problem));
}

std::string element_text(const FileArray& array) {
  static constexpr const char* kinds[] = {"", "int", "uint", "float"};
  return fmt::format("{}{}", kinds[array.kind], 8 * array.bytes);
}

std::vector<std::uint64_t> shape_of(const FileArray& array) {
  std::vector<std::uint64_t> shape = array.extent;
  if (array.reversed) std::ranges::reverse(shape);
  return shape;
}

std::string shape_text(const FileArray& array) { return fmt::format("{}", fmt::join(shape_of(array), " x ")); }

}  // namespace tofgraph::foreign
