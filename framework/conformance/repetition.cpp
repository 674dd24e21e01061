// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks by repetition of the same stage: results, memory, threads, time.
#include "conformance/allocations.hpp"
#include "conformance/trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace tofgraph::conformance {
namespace {

constexpr std::uint64_t frame_count = 8;

/// @throws NotApplicable if the stage is not declared stateless or refuses its frames
std::unique_ptr<Trial> stateless(const Subject& subject) {
  if ((subject.plugin().flags & TOFGRAPH_STAGE_STATELESS) == 0)
    throw NotApplicable("it says that it works frame by frame, in their order");
  std::unique_ptr<Trial> trial = ready(subject, {.watched = false});
  if (const std::string refusal = or_refuses([&] { trial->digests(1); }); !refusal.empty())
    throw NotApplicable(refusal);
  return trial;
}

/// Minimum run time over nine frames, s, because the machine may be busy. @throws Refusal
double seconds_of(Trial& trial) {
  std::vector<double> seconds;
  for (std::uint64_t i = 0; i < 9; ++i) {
    tofgraph_frame frame = trial.frame(i);
    const auto start = std::chrono::steady_clock::now();
    trial.process(frame);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return *std::ranges::min_element(seconds);
}

/// Puts the content of another frame into the slots of a used one, as happens in a run.
void refill(tofgraph_frame& used, const tofgraph_frame& frame) {
  used.clear();
  for (const tofgraph_frame::Channel& channel : frame.channels) used.slot(channel.name) = channel;
  used.metadata = frame.metadata;
}

std::vector<tofgraph_frame> arriving(Trial& trial, std::uint64_t count) {
  std::vector<tofgraph_frame> frames;
  for (std::uint64_t i = 0; i < count; ++i) frames.push_back(trial.frame(i));
  return frames;
}

/// Conditions for enough frames from a source, if it has a parameter `frames`.
Conditions for_many_frames(const Subject& subject) {
  Conditions conditions{.watched = false};
  for (const tofgraph_parameter& p : subject.plugin().own_parameters) {
    if (std::string_view(p.name) == "frames" && std::string_view(subject.plugin().kind) == "source")
      conditions.settings["frames"] = "1000";
  }
  return conditions;
}

}  // namespace

std::string repeats(const Subject& subject) {
  const std::unique_ptr<Trial> first = ready(subject, {.watched = false}), second = ready(subject, {.watched = false});
  return or_refuses([&] {
    const std::vector<std::size_t> once = first->digests(3), again = second->digests(3);
    if (once != again) throw Violation("two stages with the same settings give other frames for the same frames");
  });
}

std::string remembers_nothing(const Subject& subject) {
  const std::unique_ptr<Trial> trial = stateless(subject);
  const std::vector<std::size_t> forwards = trial->digests(frame_count);
  for (std::uint64_t i = frame_count; i-- > 0;) {
    tofgraph_frame frame = trial->frame(i);
    if ((trial->process(frame) ? Trial::digest(frame) : 0) != forwards[i])
      throw Violation(
          "it remembers frames although it says that it is stateless: a frame that comes after another one becomes "
          "something else");
  }
  return {};
}

std::string runs_on_threads(const Subject& subject) {
  const std::unique_ptr<Trial> trial = stateless(subject);
  const std::vector<std::size_t> expected = trial->digests(frame_count);
  const std::vector<tofgraph_frame> frames = arriving(*trial, frame_count);
  std::atomic<bool> differs{false};
  std::vector<std::string> errors(4);
  const auto work = [&](std::size_t thread) {
    try {
      const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(500);
      for (std::uint64_t round = 0; !differs && (round < 40 || std::chrono::steady_clock::now() < end); ++round) {
        const std::uint64_t number = (round + thread) % frame_count;
        tofgraph_frame frame = frames[number];
        if ((trial->process(frame) ? Trial::digest(frame) : 0) != expected[number]) differs = true;
      }
    } catch (const std::exception& error) {
      errors[thread] = error.what();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < errors.size(); ++i) threads.emplace_back(work, i);
  for (std::thread& thread : threads) thread.join();
  if (differs) throw Violation("frames become something else when several are in work at the same time: a data race");
  for (const std::string& error : errors)
    if (!error.empty()) throw Violation("with several frames in work at the same time it fails: " + error);
  return {};
}

std::string is_steady(const Subject& subject) {
  if ((subject.plugin().flags & TOFGRAPH_STAGE_STEADY) == 0)
    throw NotApplicable("it does not say that it allocates nothing");
  if (!memory_is_counted) throw NotApplicable("the sanitizer's memory cannot be counted");
  const std::unique_ptr<Trial> trial = ready(subject, for_many_frames(subject));
  const std::vector<tofgraph_frame> later = arriving(*trial, 20);
  tofgraph_frame used = later.front();
  try {
    for (const tofgraph_frame& frame : later) {
      refill(used, frame);
      if (!trial->process(used) && trial->is_source()) throw NotApplicable("it has too few frames");
    }
    std::size_t calls = 0;
    for (const tofgraph_frame& frame : later) {
      refill(used, frame);
      const CountedCalls counted;
      trial->process(used);
      calls += CountedCalls::count();
    }
    if (calls >= later.size())
      throw Violation(
          fmt::format("it asks for memory {} times a frame, but says that it does not", calls / later.size()));
  } catch (const Refusal& refusal) {
    throw NotApplicable(refusal.what());
  }
  return {};
}

std::string keeps_its_memory(const Subject& subject) {
  constexpr std::uint64_t few_frames = 50, more_frames = 250, few_bytes = 256;
  if (!memory_is_counted) throw NotApplicable("the sanitizer's memory cannot be counted");
  const Conditions conditions = for_many_frames(subject);
  const std::unique_ptr<Trial> source = ready(subject, conditions);  // owns the memory of the frames
  const std::vector<tofgraph_frame> frames = arriving(*source, 10);
  const bool may_remember = (subject.plugin().flags & TOFGRAPH_STAGE_STATELESS) == 0;
  // A stage with state may keep memory until it is destroyed.
  const auto kept_after = [&](std::uint64_t count) {
    const auto before = static_cast<double>(memory_in_use());
    std::unique_ptr<Trial> trial = ready(subject, conditions);
    for (std::uint64_t i = 0; i < count; ++i) {
      tofgraph_frame frame = frames[i % frames.size()];
      frame.metadata.number = i;
      if (!trial->process(frame) && trial->is_source()) throw NotApplicable("it has too few frames");
    }
    if (may_remember) trial->finish();
    if (may_remember) trial.reset();
    return static_cast<double>(memory_in_use()) - before;
  };
  try {
    kept_after(few_frames);
    const double few = kept_after(few_frames), more = kept_after(more_frames);
    const double each = (more - few) / (more_frames - few_frames);
    if (each > few_bytes)
      throw Violation(fmt::format("it leaks: {:.0f} bytes are kept for every frame, at most {}", each, few_bytes));
  } catch (const Refusal& refusal) {
    throw NotApplicable(refusal.what());
  }
  return {};
}

std::string is_quick(const Subject& subject) {
  std::vector<double> others;
  const graph::PluginRegistry registry(graph::plugin_path({}));
  for (const graph::PluginFile& file : registry.files()) {
    if (file.kind != subject.plugin().kind || file.name == subject.plugin().name) continue;
    const Subject other{file.path, subject.seed, {}, subject.scratch};
    try {
      Trial trial(other, {.watched = false});
      others.push_back(seconds_of(trial));
    } catch (const std::runtime_error&) {  // needs files or is broken
    }
  }
  if (others.size() < 5) throw NotApplicable("there are too few others of its kind");
  std::ranges::nth_element(others, others.begin() + static_cast<std::ptrdiff_t>(others.size() / 2));
  const double median = others[others.size() / 2];
  const std::unique_ptr<Trial> trial = ready(subject, {.watched = false});
  double own = 0;
  if (const std::string refusal = or_refuses([&] { own = seconds_of(*trial); }); !refusal.empty())
    throw NotApplicable(refusal);
  std::string told = fmt::format("{:.3g} ms a frame, the median of its kind is {:.3g} ms", 1e3 * own, 1e3 * median);
  // Half of the filters only copy, so a neighbourhood search would fail a limit based on their median alone.
  constexpr double long_time = 0.1;  // s
  if (own > std::max(1000 * median, long_time)) throw Violation(told);
  return told;
}

}  // namespace tofgraph::conformance
