// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/instance.hpp"

#include "config/paths.hpp"
#include "graph/open_outputs.hpp"
#include "graph/running_call.hpp"
#include "graph/validation.hpp"
#include "io/border.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tofgraph::graph {
namespace {

/// @throws std::runtime_error the plugin's error message
void fail(const Plugin& plugin, const char* otherwise) {
  if (last_failure().defect) throw BrokenPromise(last_failure().message(plugin));
  throw std::runtime_error(last_failure().text.empty() ? otherwise : last_failure().text);
}

void forget_failure() {
  if (Failure& failure = last_failure(); !failure.text.empty()) failure = {};
}

/// A call that reports success but sets an error message has failed.
std::optional<Failure> outcome(int status, const char* otherwise) {
  Failure failure = std::exchange(last_failure(), {});
  if (status == TOFGRAPH_STATUS_OK && failure.text.empty()) return std::nullopt;
  if (failure.text.empty()) failure.text = otherwise;
  return failure;
}

}  // namespace

Failure& last_failure() {
  thread_local Failure failure;
  return failure;
}

std::string Failure::message(const Plugin& plugin) const {
  return defect ? fmt::format("{}\n         this is a bug in the plugin {}", text, plugin.file.path.string()) : text;
}

void keep_failure() noexcept {
  try {
    throw;
  } catch (const io::PluginDefect& error) {
    last_failure() = {"", error.what(), true};
  } catch (const std::exception& error) {
    last_failure() = {"", error.what()};
  } catch (...) {
    last_failure() = {"", "the host failed"};
  }
}

Instance::Instance(const Plugin& plugin, std::string name, Host& host)
    : plugin_(plugin), name_(std::move(name)), host_(host) {}

Instance::~Instance() {
  if (self_ == nullptr) return;
  const RunningCall call(*this, "destroy");
  plugin_.destroy(self_);
}

std::optional<Failure> Instance::create(const tofgraph_value* values) {
  forget_failure();
  const RunningCall call(*this, "create");
  const int status = plugin_.create(&host_table(), this, values, &self_);
  auto failure = outcome(status, "failed without an error message");
  if (!failure && self_ == nullptr) failure = Failure{"", "create() returned nothing", true};
  if (failure) self_ = nullptr;
  return failure;
}

std::optional<Failure> Instance::prepare(std::span<const tofgraph_stream* const> streams, std::size_t index,
                                         OutputStream* output_stream) {
  forget_failure();
  index_ = index;
  output_stream_ = output_stream;
  const RunningCall call(*this, "prepare");
  const int status = plugin_.prepare(self_, streams.data(), streams.size());
  output_stream_ = nullptr;
  starting_ = false;
  return outcome(status, "failed without an error message");
}

int Instance::process(std::span<tofgraph_frame* const> frames) {
  forget_failure();
  const OutputScope outputs;
  const RunningCall call(*this, "process", frames.front()->metadata.number);
  const int status = plugin_.process(self_, frames.data(), frames.size());
  const bool fine = status == TOFGRAPH_STATUS_OK || status == TOFGRAPH_STATUS_END;
  if (!fine || !last_failure().text.empty()) {
    outputs.name_finally(last_failure().text);
    fail(plugin_, "the stage failed without an error message");
  }
  outputs.commit();
  return status;
}

void Instance::finish() {
  if (plugin_.finish == nullptr || self_ == nullptr) return;
  forget_failure();
  const OutputScope outputs;
  const RunningCall call(*this, "finish");
  if (plugin_.finish(self_) != TOFGRAPH_STATUS_OK || !last_failure().text.empty()) {
    outputs.name_finally(last_failure().text);
    fail(plugin_, "the stage could not finish and gave no error message");
  }
  outputs.commit();
}

std::optional<Failure> Instance::change(const tofgraph_value* values) {
  forget_failure();
  const RunningCall call(*this, "change");
  return outcome(plugin_.change(self_, values), "failed without an error message");
}

void Instance::stop() noexcept {
  if (plugin_.stop == nullptr || self_ == nullptr) return;
  forget_failure();
  const RunningCall call(*this, "stop");
  plugin_.stop(self_);
  const Failure failure = std::exchange(last_failure(), {});
  if (failure.text.empty() || !host_.message) return;
  try {
    host_.message(name_, "cannot be stopped: " + failure.text, true);
  } catch (const std::exception&) {  // no memory for a message; the run ends with its own error
  }
}

bool Instance::claim(std::size_t parameter) {
  const std::scoped_lock lock(claims_mutex_);
  return claims_.insert(parameter).second;
}

void Instance::add_file(const std::string& path) {
  if (std::ranges::find(files_, path, &UsedFile::path) == files_.end()) files_.emplace_back(path);
}

}  // namespace tofgraph::graph
