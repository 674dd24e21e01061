// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks of the processing of frames: inputs, written memory, outputs.
#include "conformance/trial.hpp"
#include "graph/validation.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace tofgraph::conformance {
namespace {

using graph::BrokenPromise;

/// Runs some frames, then finish(), if they were accepted. @throws Refusal, Violation
void run_frames(Trial& trial, std::uint64_t count, Content content = Content::ordinary) {
  try {
    for (std::uint64_t i = 0; i < count; ++i) {
      tofgraph_frame frame = trial.frame(i, content);
      if (!trial.process(frame) && trial.is_source()) break;
    }
    trial.finish();
  } catch (const BrokenPromise& broken) {
    throw Violation(broken.what());
  }
}

/// As run_frames, with a newly created stage; refused input counts as passed.
std::string frames_of(const Subject& subject, const Conditions& conditions, Content content = Content::ordinary) {
  const std::unique_ptr<Trial> trial = ready(subject, conditions);
  return or_refuses([&] { run_frames(*trial, 3, content); });
}

}  // namespace

std::string runs(const Subject& subject) {
  const std::unique_ptr<Trial> trial = ready(subject, {.watched = false});
  try {
    run_frames(*trial, 3);
  } catch (const Refusal& refusal) {
    throw Violation(fmt::format("it is prepared for a stream and then refuses its frames: {}", refusal.what()));
  }
  return {};
}

std::string writes_its_own(const Subject& subject) { return frames_of(subject, {}); }

std::string keeps_lengths(const Subject& subject) {
  const std::unique_ptr<Trial> trial = ready(subject);
  tofgraph_frame frame = trial->frame(0);
  bool left = false;
  const std::string refusal = or_refuses([&] { left = trial->process(frame); });
  if (!left) throw NotApplicable(refusal.empty() ? "no frame leaves" : refusal);
  std::size_t seen = 0;
  for (const graph::Channel& channel : trial->output().channels) {
    const tofgraph_frame::Channel* found = frame.find(channel.name);
    if (!is_length_channel(channel.name) || channel.name == "points" || found == nullptr) continue;
    if (found->type != TOFGRAPH_TYPE_F32) continue;
    for (const float length : Array<const float>(graph::view_of(*found)).span()) {
      if (std::isnan(length)) continue;
      ++seen;
      if (length < 1e-3F || length > 100)
        throw Violation(
            fmt::format("'{}' is {} m where about 1 m arrives: is it in another unit?", channel.name, length));
    }
  }
  if (seen == 0) throw NotApplicable("no length leaves");
  return {};
}

std::string takes_sizes(const Subject& subject) {
  std::string told;
  for (const auto& [rows, columns] : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{
           {37, 61}, {1, 1}, {1, 7}, {7, 1}, {3, 2}, {61, 2}}) {
    const std::string refusal = or_refuses([&, size = std::pair(rows, columns)] {
      Trial trial(subject, {.rows = size.first, .columns = size.second});
      run_frames(trial, 2);
    });
    if (!refusal.empty()) told = fmt::format("{} x {} {}", rows, columns, refusal);
  }
  return told;
}

std::string takes_empty(const Subject& subject) {
  return or_refuses([&] {
    Trial trial(subject, {.rows = 0, .columns = 0, .sizes_known = false});
    run_frames(trial, 2);
  });
}

std::string takes_invalid(const Subject& subject) { return frames_of(subject, {}, Content::invalid); }

std::string takes_extremes(const Subject& subject) {
  const std::string refusal = frames_of(subject, {}, Content::denormal);
  return refusal.empty() ? frames_of(subject, {}, Content::huge) : refusal;
}

std::string takes_larger(const Subject& subject) {
  const std::unique_ptr<Trial> large = ready(subject, {.rows = 96, .columns = 131});
  const std::unique_ptr<Trial> trial = ready(subject);
  return or_refuses([&] {
    tofgraph_frame frame = large->frame(0);
    try {
      trial->process(frame);
    } catch (const BrokenPromise& broken) {
      const std::string_view why = broken.what();
      if (why.find(" was announced") == std::string_view::npos) throw Violation(broken.what());
    }
  });
}

namespace {

/// Replaces the host's read(): each row is followed by a gap filled with NaN bytes.
int read_with_gaps(tofgraph_frame* frame, const char* channel, tofgraph_view* view) {
  const int status = graph::host_table().read(frame, channel, view);
  if (status != TOFGRAPH_STATUS_OK || view->rank < 2) return status;
  static thread_local std::vector<std::vector<char>> kept;  // kept until the process ends, after a few frames
  const std::uint64_t columns = view->extent[view->rank - 1];
  const std::size_t row = columns * element_size(view->type), gap = 64;
  std::size_t rows = 1;
  for (std::uint32_t i = 0; i + 1 < view->rank; ++i) rows *= view->extent[i];
  std::vector<char>& memory = kept.emplace_back(rows * (row + gap) + 1, static_cast<char>(0xFF));
  for (std::size_t i = 0; i < rows; ++i)
    std::memcpy(&memory[i * (row + gap)], static_cast<const char*>(view->data) + i * row, row);
  view->data = memory.data();
  view->stride[view->rank - 2] = static_cast<std::int64_t>(row + gap);
  for (std::uint32_t i = view->rank - 2; i-- > 0;)
    view->stride[i] = view->stride[i + 1] * static_cast<std::int64_t>(view->extent[i + 1]);
  return status;
}

const graph::Plugin* original = nullptr;

int create_with_gaps(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  static tofgraph_host gapped;
  gapped = *host;
  gapped.read = read_with_gaps;
  return original->create(&gapped, context, values, self);
}

}  // namespace

std::string takes_gaps(const Subject& subject) {
  original = &subject.plugin();
  graph::Plugin gapped;
  static_cast<tofgraph_descriptor&>(gapped) = static_cast<const tofgraph_descriptor&>(*original);
  gapped.file = original->file;
  gapped.own_ports = original->own_ports;
  gapped.own_parameters = original->own_parameters;
  gapped.create = create_with_gaps;
  const std::unique_ptr<Trial> plain = ready(subject, {.watched = false});
  return or_refuses([&] {
    const std::vector<std::size_t> expected = plain->digests(2);
    Trial trial(subject, gapped, {.watched = false});
    if (trial.digests(2) != expected)
      throw Violation("it gives other frames when the rows of a channel have gaps between them: strides count");
  });
}

}  // namespace tofgraph::conformance
