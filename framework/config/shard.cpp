// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/shard.hpp"

#include "config/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <thread>
#include <utility>

namespace tofgraph::config {
namespace {

std::unique_ptr<Ranks>& the_ranks() {
  static std::unique_ptr<Ranks> all = std::make_unique<Ranks>();
  return all;
}

bool read_number(std::string_view text, std::size_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::string Shard::text() const { return fmt::format("{}/{}", index + 1, count); }

Shard parse_shard(const std::string& text) {
  if (text.empty()) return {};
  const std::string_view view = text;
  const std::size_t slash = view.find('/');
  Shard shard;
  if (slash != std::string_view::npos && read_number(view.substr(0, slash), shard.index) &&
      read_number(view.substr(slash + 1), shard.count) && shard.index >= 1 && shard.index <= shard.count &&
      shard.count <= Shard::max_count) {
    --shard.index;
    return shard;
  }
  throw ConfigurationError(
      fmt::format("--shard: error: '{}' is not a part of the work, expected I/N with I from 1 to N\n"
                  "         example: --shard 3/16",
                  text));
}

const Ranks& ranks() { return *the_ranks(); }
unsigned default_threads() { return ranks().size() > 1 ? 1 : std::max(1U, std::thread::hardware_concurrency()); }
void set_ranks(std::unique_ptr<Ranks> ranks) { the_ranks() = std::move(ranks); }

}  // namespace tofgraph::config
