// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/case_files.hpp"

#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <fstream>

namespace tofgraph::diagnosis {
namespace {

constexpr const char* case_format = "tofgraph-confidence-case";
constexpr int case_version = 1;

}  // namespace

CaseFiles::CaseFiles(std::filesystem::path folder, std::span<const InputFile> inputs, const std::string& options)
    : folder_(std::move(folder)) {
  std::string all = fmt::format("version {}\n{}\n", case_version, options);
  for (const InputFile& input : inputs) all += input.sha256 + "\n";
  key_ = io::sha256_of(all);
}

std::filesystem::path CaseFiles::path(std::size_t number) const {
  return folder_ / fmt::format("{}-{}.json", key_.substr(0, 16), number + 1);
}

std::optional<CaseOutcome> CaseFiles::load(std::size_t number) const {
  std::ifstream stream(path(number));
  if (!stream) return std::nullopt;
  const nlohmann::json j = nlohmann::json::parse(stream, nullptr, false);
  if (!j.is_object() || j.value("format", "") != case_format || j.value("version", 0) != case_version ||
      j.value("key", "") != key_ || j.value("case", std::size_t{0}) != number + 1 || !j.contains("named") ||
      !j["named"].is_boolean() || !j.contains("right") || !j["right"].is_boolean())
    return std::nullopt;
  return CaseOutcome{j["named"], j["right"]};
}

void CaseFiles::save(std::size_t number, const CaseOutcome& outcome) const {
  const nlohmann::json j = {{"format", case_format}, {"version", case_version}, {"key", key_},
                            {"case", number + 1},    {"named", outcome.named},  {"right", outcome.right}};
  io::write_file(path(number), j.dump(1) + "\n");
}

}  // namespace tofgraph::diagnosis
