// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph {

/// Removes or renames channels, e.g. before branches join that have two of the same name. Content and processing
/// history are kept; no memory is copied. The rays belong to the camera and are unchanged.
struct Channels final : Filter {
  In<void> every{this, "*", {.text = "the channels to choose from"}};
  Param<std::string> keep{this, "keep", {.text = "which to keep, e.g. [depth, flags]; default: all"}};
  Param<std::string> drop{this, "drop", {.text = "which to remove, e.g. [sigma]"}};
  Param<std::string> rename{
      this, "rename", {.text = "which to rename: [old=new, ...], e.g. [distance=distance_short]"}};

  void prepare(Setup& setup) {
    if (!keep.given() && !drop.given() && !rename.given())
      throw ConfigError("drop", "there is nothing to do: give keep, drop or rename, e.g. drop: [sigma]");
    if (keep.given() && drop.given()) throw ConfigError("drop", "and keep exclude each other: write one");
    const std::vector<std::string> kept = names(setup, "keep", *keep), gone = names(setup, "drop", *drop);
    for (const tofgraph_channel& channel : setup.channels()) {
      const std::string name = channel.name;
      const bool stays = keep.given() ? is_in(kept, name) : !is_in(gone, name);
      if (name != "rays" && !stays) dropped_.push_back(name);
    }
    for (const std::string& name : dropped_) setup.withdraw(name.c_str());
    choose_names(setup);
  }

  void process(Frame& frame) const {
    for (const std::string& name : dropped_) frame.drop(name.c_str());
    for (const auto& [before, after] : renamed_) frame.rename(before.c_str(), after.c_str());
  }

 private:
  static bool is_in(const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  }

  static std::vector<std::string> words(const std::string& text) {
    std::istringstream stream(text);
    return {std::istream_iterator<std::string>(stream), {}};
  }

  static void check(const Setup& setup, const char* parameter, const std::string& name) {
    if (name == "rays") throw ConfigError(parameter, "the rays belong to the camera and cannot be changed here");
    if (setup.find(name) != nullptr) return;
    std::string all;
    for (const tofgraph_channel& channel : setup.channels())
      if (std::string_view(channel.name) != "rays") all += (all.empty() ? "" : ", ") + std::string(channel.name);
    throw ConfigError(parameter, "there is no '" + name + "'; what arrives has " + all);
  }

  static std::vector<std::string> names(const Setup& setup, const char* parameter, const std::string& text) {
    std::vector<std::string> all = words(text);
    for (const std::string& name : all) check(setup, parameter, name);
    return all;
  }

  void choose_names(const Setup& setup) {
    for (const std::string& word : words(*rename)) {
      const auto equals = word.find('=');
      if (equals == 0 || equals == std::string::npos || equals + 1 == word.size())
        throw ConfigError("rename", "'" + word + "' is not of the form old=new, e.g. [distance=distance_short]");
      const std::string before = word.substr(0, equals), after = word.substr(equals + 1);
      check(setup, "rename", before);
      if (is_in(dropped_, before)) throw ConfigError("rename", "'" + before + "' is removed");
      if (after.find('@') != std::string::npos) throw ConfigError("rename", "a name must not contain @");
      if (setup.find(after) != nullptr && !is_in(dropped_, after))
        throw ConfigError("rename", "there is a channel '" + after + "' already");
      for (const auto& [other, name] : renamed_)
        if (other == before || name == after)
          throw ConfigError("rename", "'" + (other == before ? before : after) + "' appears twice");
      renamed_.emplace_back(before, after);
    }
    announce(setup);
  }

  std::string new_name(const std::string& channel) const {
    const auto found = std::ranges::find(renamed_, channel, &std::pair<std::string, std::string>::first);
    return found == renamed_.end() ? channel : found->second;
  }

  /// Announces renamed channels and their sigma.
  void announce(const Setup& setup) const {
    for (const tofgraph_channel& channel : setup.channels()) {
      const std::string name = new_name(channel.name), of = new_name(channel.of);
      if (is_in(dropped_, channel.name) || (name == channel.name && of == channel.of)) continue;
      tofgraph_channel made = channel;
      made.name = name.c_str();
      made.of = of.c_str();
      if (name != channel.name) setup.withdraw(channel.name);
      setup.provide(made);
    }
  }

  std::vector<std::string> dropped_;
  std::vector<std::pair<std::string, std::string>> renamed_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Channels, "Removes or renames channels")
