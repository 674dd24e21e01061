// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

namespace tofgraph::io {
namespace fs = std::filesystem;
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

bool only_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Minimum number of digits from the text between the braces, {frame} or {frame:06}; -1 for anything else.
int digits_of(std::string_view placeholder) {
  if (placeholder == "frame") return 1;
  if (!placeholder.starts_with("frame:0")) return -1;
  const std::string_view number = placeholder.substr(std::string_view("frame:0").size());
  int digits = -1;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), digits);
  const bool right = error == std::errc() && end == number.data() + number.size() && digits > 0 && digits < 20;
  return right ? digits : -1;
}

[[noreturn]] void refuse(const fs::path& path, const char* what, int error) {
  throw std::runtime_error(fmt::format("{} {}: {}", path.string(), what, reason(error)));
}

void write_all(const fs::path& path, int descriptor, std::span<const std::byte> data) {
  while (!data.empty()) {
    const ssize_t written = ::write(descriptor, data.data(), data.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) refuse(path, "cannot be written", errno);
    data = data.subspan(static_cast<std::size_t>(written));
  }
}

}  // namespace

FileWriter::FileWriter(fs::path path) : path_(std::move(path)), descriptor_(open(path_.c_str(), O_WRONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) refuse(path_, "cannot be opened", errno);
}
FileWriter::~FileWriter() { ::close(descriptor_); }
void FileWriter::write(std::span<const std::byte> data) { write_all(path_, descriptor_, data); }

OutputFile::OutputFile(fs::path final_path) : final_(std::move(final_path)) {
  static std::atomic<unsigned> count{0};
  std::error_code error;
  if (final_.has_parent_path()) fs::create_directories(final_.parent_path(), error);
  temporary_ = final_;
  temporary_.replace_filename(fmt::format(".{}.{}-{}.part", final_.filename().string(), getpid(), count++));
  descriptor_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail("cannot be created", error ? error.value() : errno);
}

OutputFile::~OutputFile() {
  close();
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

void OutputFile::close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

void OutputFile::fail(const char* what, int error) const { refuse(final_, what, error); }

void OutputFile::write(std::span<const std::byte> data) { write_all(final_, descriptor_, data); }

void OutputFile::sync() {
  // Some file systems do not support syncing (EINVAL, ENOTSUP); nothing more can be done there.
  if (fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) fail("cannot be written", errno);
}

void OutputFile::commit() {
  if (const int descriptor = std::exchange(descriptor_, -1); ::close(descriptor) != 0) fail("cannot be written", errno);
  if (rename(temporary_.c_str(), final_.c_str()) != 0) fail("cannot be renamed to its final name", errno);
  temporary_.clear();
}

void write_file(const fs::path& path, std::string_view content) {
  OutputFile file(path);
  file.write(content);
  file.sync();
  file.commit();
}

OutputPattern::OutputPattern(const fs::path& path, const std::string& written) : folder_(path.parent_path()) {
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(fmt::format(
        "{}: {}; example: out/cloud_{{frame:06}}.pcd for out/cloud_000000.pcd and so on", path.string(), why));
  };
  const std::string name = path.filename().string();
  if (fs::path(written).parent_path().string().find_first_of("{}") != std::string::npos)
    refuse("the frame's number can be only in the file's name, not in a folder's");
  if (name.empty() || name == "." || name == "..") refuse("names a folder, not a file");
  const auto open = name.find('{');
  const auto close = name.find('}');
  before_ = name.substr(0, open);
  numbered_ = open != std::string::npos || close != std::string::npos;
  if (!numbered_) return;
  if (open == std::string::npos || close == std::string::npos || close < open)
    refuse("a brace is not closed or not opened");
  after_ = name.substr(close + 1);
  digits_ = digits_of(std::string_view(name).substr(open + 1, close - open - 1));
  if (digits_ < 0) refuse(name.substr(open, close - open + 1) + " is unknown: only {frame} and {frame:06} are allowed");
  if (after_.find_first_of("{}") != std::string::npos) refuse("the frame's number can appear only once");
}

OutputPattern OutputPattern::of_file(const fs::path& path) {
  OutputPattern file;
  file.folder_ = path.parent_path();
  file.before_ = path.filename().string();
  return file;
}

OutputPattern OutputPattern::in_folder(fs::path folder) const {
  OutputPattern pattern = *this;
  pattern.folder_ = std::move(folder);
  return pattern;
}

OutputPattern OutputPattern::with_number() const {
  OutputPattern pattern = *this;
  pattern.before_ = fs::path(before_).stem().string() + "_";
  pattern.after_ = fs::path(before_).extension().string();
  pattern.digits_ = 6;
  pattern.numbered_ = true;
  return pattern;
}

std::string OutputPattern::text() const {
  if (!numbered_) return (folder_ / before_).string();
  const std::string number = digits_ == 1 ? "{frame}" : fmt::format("{{frame:0{}}}", digits_);
  return (folder_ / (before_ + number + after_)).string();
}

fs::path OutputPattern::path(std::uint64_t frame) const {
  if (!numbered_) return folder_ / before_;
  return folder_ / fmt::format("{}{:0{}}{}", before_, frame, digits_, after_);
}

fs::path OutputPattern::companion(std::string_view extension) const {
  std::string stem = numbered_ ? before_ : fs::path(before_).stem().string();
  while (!stem.empty() && std::string_view("_-. ").find(stem.back()) != std::string_view::npos) stem.pop_back();
  if (numbered_) stem += fs::path("x" + after_).stem().string().substr(1);
  if (stem.empty()) stem = "frames";
  return folder_ / (stem + std::string(extension));
}

/// Returns true if a numbered pattern gives this name for some frame.
bool OutputPattern::produces(std::string_view name) const {
  if (name.size() < before_.size() + after_.size() || !name.starts_with(before_) || !name.ends_with(after_))
    return false;
  const std::string_view number = name.substr(before_.size(), name.size() - before_.size() - after_.size());
  const auto least = static_cast<std::size_t>(digits_);
  return only_digits(number) && number.size() >= least && (number.size() == least || number.front() != '0');
}

bool OutputPattern::overlaps(const OutputPattern& other) const {
  if (folder_ != other.folder_) return false;
  if (!numbered_ && !other.numbered_) return before_ == other.before_;
  if (!numbered_) return other.produces(before_);
  if (!other.numbered_) return produces(other.before_);
  // The part by which one prefix or suffix is longer must consist of digits of the other's number.
  const auto digits_apart = [](std::string_view a, std::string_view b, bool at_end) {
    if (a.size() < b.size()) std::swap(a, b);
    if (at_end ? !a.ends_with(b) : !a.starts_with(b)) return false;
    return a.size() == b.size() || only_digits(at_end ? a.substr(0, a.size() - b.size()) : a.substr(b.size()));
  };
  return digits_apart(before_, other.before_, false) && digits_apart(after_, other.after_, true);
}

std::vector<fs::path> OutputPattern::members() const {
  std::error_code error;
  std::vector<fs::path> found;
  if (!numbered_) {
    if (fs::exists(folder_ / before_, error)) found.push_back(folder_ / before_);
    return found;
  }
  for (const auto& entry : fs::directory_iterator(folder_.empty() ? fs::path(".") : folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (produces(name)) found.push_back(folder_ / name);
  }
  std::ranges::sort(found);
  return found;
}

fs::path OutputPattern::existing() const {
  const std::vector<fs::path> found = members();
  return found.empty() ? fs::path() : found.front();
}

std::string write_error(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return fmt::format("{} is a folder", path.string());
  fs::path folder = path.parent_path();
  while (!folder.empty() && !fs::exists(folder, error)) folder = folder.parent_path();
  if (folder.empty()) folder = ".";
  if (!fs::is_directory(folder, error))
    return fmt::format("{} cannot be written: {} is not a folder", path.string(), folder.string());
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    const int why = errno;
    return fmt::format("{} cannot be written: the folder {} cannot be written to: {}", path.string(), folder.string(),
                       reason(why));
  }
  return {};
}

std::string input_problem(const fs::path& file, std::span<const fs::path> inputs) {
  std::error_code error;
  const auto is_it = [&](const fs::path& input) { return fs::equivalent(file, input, error); };
  if (std::ranges::none_of(inputs, is_it)) return {};
  return fmt::format("{} is an input, so it cannot also be written: give the output another name", file.string());
}

std::string input_problem(const OutputPattern& pattern, std::span<const fs::path> inputs) {
  for (const fs::path& file : pattern.members()) {
    if (std::string problem = input_problem(file, inputs); !problem.empty()) return problem;
  }
  return {};
}

std::string output_problem(const OutputPattern& pattern, bool overwrite) {
  std::string problem = write_error(pattern.path(0));
  if (!problem.empty() || overwrite) return problem;
  const fs::path existing = pattern.existing();
  return existing.empty() ? std::string() : output_problem(existing, overwrite);
}

std::string output_problem(const fs::path& file, bool overwrite, std::string_view allowed_by) {
  std::string problem = write_error(file);
  if (!problem.empty() || overwrite) return problem;
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  return fmt::format("{} already exists: {} allows it to be replaced", file.string(), allowed_by);
}

}  // namespace tofgraph::io
