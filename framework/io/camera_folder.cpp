// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/camera_folder.hpp"

#include "config/quantity.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

namespace tofgraph::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* index_key = "camera_folder";

bool is_index(const fs::path& file) {
  std::error_code error;
  if (file.filename() != folder_index_name || !fs::is_regular_file(file, error)) return false;
  try {
    const config::Value document = config::load_document(file);
    return !document.entries.empty() && document.entries.front().key == index_key;
  } catch (const config::ConfigurationError&) {
    return false;  // reported when it is read as a profile
  }
}

FolderFile read_folder_file(const config::Value& value, config::Diagnostics& diagnostics) {
  config::Reader reader(value, diagnostics, "the file");
  FolderFile file;
  if (const config::Entry* entry = reader.need("file", "noise/noise.yaml")) file.file = entry->value.text;
  if (const config::Entry* entry = reader.need("sha256", "64 hexadecimal digits")) file.sha256 = entry->value.text;
  reader.finish();
  return file;
}

std::vector<FolderFile> read_folder_files(config::Reader& reader, const char* key, config::Diagnostics& diagnostics) {
  std::vector<FolderFile> files;
  if (const config::Entry* list = reader.need(key, "[{file: noise/noise.yaml, sha256: 64 hexadecimal digits}]"))
    for (const config::Value& item : list->value.items) files.push_back(read_folder_file(item, diagnostics));
  return files;
}

FolderEntry read_folder_entry(const config::Value& value, config::Diagnostics& diagnostics) {
  config::Reader reader(value, diagnostics, "the entry");
  FolderEntry entry;
  entry.kind = reader.word("kind", "");
  entry.serial = reader.word("serial", "");
  entry.date = reader.word("date", "");
  entry.valid_until = reader.word("valid_until", "");
  if (value.is_map() && value.find("temperature") != nullptr) {
    const std::vector<double> ends = reader.numbers("temperature", "K", "[15 degC, 35 degC]", {0, 0});
    entry.temperature = {ends[0], ends[1]};
  }
  entry.files = read_folder_files(reader, "files", diagnostics);
  reader.finish();
  if (entry.files.empty()) diagnostics.error(value.at, "the entry names no file");
  return entry;
}

std::string file_text(const FolderFile& file) {
  return fmt::format("{{file: {}, sha256: {}}}", config::yaml_word(file.file.generic_string()), file.sha256);
}

std::string entry_text(const FolderEntry& entry) {
  std::string text = fmt::format("  - kind: {}\n", config::yaml_word(entry.kind));
  const auto add = [&](const char* key, const std::string& word) {
    if (!word.empty()) text += fmt::format("    {}: {}\n", key, config::yaml_word(word));
  };
  add("serial", entry.serial);
  add("date", entry.date);
  add("valid_until", entry.valid_until);
  if (entry.temperature)
    text += fmt::format("    temperature: [{:.6g} K, {:.6g} K]\n", entry.temperature->at(0), entry.temperature->at(1));
  text += "    files:\n";
  for (const FolderFile& file : entry.files) text += fmt::format("      - {}\n", file_text(file));
  return text;
}

std::string celsius_range(double first, double last) {
  return fmt::format("{:.4g} to {:.4g} degC", first - 273.15, last - 273.15);
}

}  // namespace

const FolderEntry* CameraFolder::find(std::string_view kind) const {
  const auto found = std::ranges::find(entries, kind, &FolderEntry::kind);
  return found != entries.end() ? &*found : nullptr;
}

fs::path CameraFolder::file_of(std::string_view kind) const {
  const FolderEntry* entry = find(kind);
  return entry != nullptr ? folder / entry->files.front().file : fs::path{};
}

fs::path cameras_folder() {
  const auto absolute = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value == '/' ? fs::path(value) : fs::path{};
  };
  if (const fs::path data = absolute("XDG_DATA_HOME"); !data.empty()) return data / "tofgraph" / "cameras";
  const fs::path home = absolute("HOME");
  return home.empty() ? home : home / ".local" / "share" / "tofgraph" / "cameras";
}

std::vector<std::string> camera_folder_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(cameras_folder(), error))
    if (is_index(entry.path() / folder_index_name)) names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

fs::path find_camera_folder(const std::string& name, const fs::path& base) {
  std::error_code error;
  const bool path = name.find('/') != std::string::npos || name.ends_with(".yaml");
  if (!path) {
    const fs::path folder = cameras_folder() / name;
    return !name.empty() && is_index(folder / folder_index_name) ? folder : fs::path{};
  }
  const fs::path file = fs::absolute(base / name).lexically_normal();
  if (fs::is_directory(file, error)) return file.has_filename() ? file : file.parent_path();
  return is_index(file) ? file.parent_path() : fs::path{};
}

CameraFolder read_camera_folder(const fs::path& folder) {
  const fs::path index = folder / folder_index_name;
  std::error_code error;
  if (!fs::is_regular_file(index, error))
    throw config::ConfigurationError(fmt::format(
        "{}: error: the folder has no {}: it is not the folder of a camera, or its files were moved elsewhere\n"
        "         give the whole folder, or make one: tofgraph camera new NAME --profile PROFILE\n",
        folder.string(), folder_index_name));
  const config::Value document = config::load_document(index);
  config::Diagnostics diagnostics;
  config::check_version(document, index_key, 1, diagnostics);
  config::Reader reader(document, diagnostics, "the camera's folder");
  reader.take(index_key);
  CameraFolder result{.folder = fs::absolute(folder).lexically_normal(),
                      .name = {},
                      .serial = {},
                      .entries = {},
                      .made = {},
                      .notes = {}};
  result.name = reader.word("name", folder.filename().string());
  result.serial = reader.word("serial", "");
  if (const config::Entry* list = reader.need("entries", "[{kind: profile, files: [..]}]"))
    for (const config::Value& item : list->value.items) result.entries.push_back(read_folder_entry(item, diagnostics));
  result.made = read_folder_files(reader, "made", diagnostics);
  if (const config::Entry* notes = reader.take("notes"))
    for (const config::Value& note : notes->value.items) result.notes.push_back(note.text);
  reader.finish();
  if (diagnostics.ok() && (result.find("profile") == nullptr || result.made.empty()))
    diagnostics.error(document.at, "the folder names no profile", "make it again: tofgraph camera new");
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return result;
}

std::vector<std::string> folder_problems(const CameraFolder& folder) {
  std::vector<std::string> problems;
  const auto check = [&](const FolderFile& file, const std::string& remedy) {
    std::error_code error;
    const fs::path path = folder.folder / file.file;
    if (!fs::is_regular_file(path, error))
      problems.push_back(fmt::format("{} is missing: was a part of the folder moved?", path.string()));
    else if (sha256_of_file(path) != file.sha256)
      problems.push_back(fmt::format("{} was changed since it was added: {}", path.string(), remedy));
  };
  for (const FolderEntry& entry : folder.entries)
    for (const FolderFile& file : entry.files)
      check(file, fmt::format("add it again, tofgraph camera add {} FILE --force", folder.name));
  for (const FolderFile& file : folder.made)
    check(file, fmt::format("it is made from the others, tofgraph camera add {} makes it again", folder.name));
  return problems;
}

void write_camera_folder(const CameraFolder& folder) {
  std::string text = fmt::format("{}: 1\nname: {}\n", index_key, config::yaml_word(folder.name));
  if (!folder.serial.empty()) text += fmt::format("serial: {}\n", config::yaml_word(folder.serial));
  text += "entries:\n";
  for (const FolderEntry& entry : folder.entries) text += entry_text(entry);
  text += "made:\n";
  for (const FolderFile& file : folder.made) text += fmt::format("  - {}\n", file_text(file));
  if (!folder.notes.empty()) text += "notes:\n";
  for (const std::string& note : folder.notes) text += fmt::format("  - {}\n", config::yaml_word(note));
  write_file(folder.folder / folder_index_name, text);
}

FolderFile hashed_file(const fs::path& folder, const fs::path& relative) {
  return {relative, sha256_of_file(folder / relative)};
}

std::vector<std::string> expired_calibrations(const CameraFolder& folder, const std::string& date,
                                              const std::array<double, 2>& temperature) {
  std::vector<std::string> messages;
  for (const FolderEntry& entry : folder.entries) {
    const std::string file = entry.files.front().file.generic_string();
    if (!entry.valid_until.empty() && !date.empty() && date > entry.valid_until)
      messages.push_back(fmt::format("the {} calibration {} is valid until {}, the recording is of {}: it is used",
                                     entry.kind, file, entry.valid_until, date));
    if (entry.temperature && (temperature[0] < entry.temperature->at(0) || temperature[1] > entry.temperature->at(1)))
      messages.push_back(fmt::format("the {} calibration {} is for {}, the recording was made at {}: it is used",
                                     entry.kind, file,
                                     celsius_range(entry.temperature->at(0), entry.temperature->at(1)),
                                     celsius_range(temperature[0], temperature[1])));
  }
  return messages;
}

}  // namespace tofgraph::io
