// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks without frames: the library, its descriptor, its parameters, creation and destruction.
#include "config/architecture.hpp"
#include "conformance/allocations.hpp"
#include "conformance/values.hpp"
#include "simulation/files/effect.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

namespace tofgraph::conformance {
namespace {

using namespace graph;

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// CPU time plus the time this process waited for a busy CPU. The latter is the second number of /proc/self/schedstat;
/// some kernels lack it, and there a busy machine counts as waiting.
double willing_seconds() {
  double running = 0, ready = 0;
  std::ifstream("/proc/self/schedstat") >> running >> ready;  // ns
  return processor_seconds() + 1e-9 * ready;
}

/// First line that a call prints to standard output, possibly empty; nothing if it prints nothing.
template <class Call> std::optional<std::string> printed_by(Call&& call) {
  constexpr const char* name = "printed.txt";
  std::fflush(stdout);
  const int kept = dup(STDOUT_FILENO), file = open(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  dup2(file, STDOUT_FILENO);
  call();
  std::fflush(stdout);
  dup2(kept, STDOUT_FILENO);
  close(kept);
  close(file);
  if (std::filesystem::file_size(name) == 0) return std::nullopt;
  std::string line;
  std::getline(std::ifstream(name), line);
  return line;
}

/// Creates the plugin for a camera or a stream, whichever it needs. @throws Refusal
void make(const Subject& subject, const Settings& settings) {
  const Plugin& plugin = subject.plugin();
  if (plugin.effect == nullptr) {
    const Trial trial(subject, {.watched = false, .settings = settings});
    return;
  }
  const ParameterValues values = values_of(plugin, settings_of(subject, settings));
  const io::CameraPtr camera = camera_of(48, 64);
  try {
    const simulation::Effect effect(plugin, values.data(), camera->view());
  } catch (const simulation::EffectError& error) {
    refuse(error.what(), error.defect);
  }
}

/// Creates the plugin; runs one frame if it is a stage.
void make_and_run(const Subject& subject, const Settings& settings) {
  if (subject.plugin().effect != nullptr) return make(subject, settings);
  Trial trial(subject, {.rows = 24, .columns = 32, .settings = settings});
  tofgraph_frame frame = trial.frame(0);
  trial.process(frame);
}

}  // namespace

std::string loads(const Subject& subject) {
  using Clock = std::chrono::steady_clock;
  const double before = processor_seconds(), willing_before = willing_seconds();
  const Clock::time_point start = Clock::now();
  void* library = nullptr;
  const std::optional<std::string> printed =
      printed_by([&] { library = dlopen(subject.path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE); });
  if (library == nullptr) {
    const std::string error = dlerror(), other = config::other_architecture(subject.path.string());
    throw Violation(other.empty() ? error : other);
  }
  const double seconds = processor_seconds() - before;
  const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
  const double waited = elapsed - (willing_seconds() - willing_before);
  std::string told = fmt::format("{:.1f} ms", 1e3 * seconds);
  if (seconds > 0.1) throw Violation(told + " of processor time until it is loaded, at most 100 ms");
  if (waited > 2) throw Violation(fmt::format("it waits for {:.1f} s while it is loaded", waited));
  if (printed) throw Violation(fmt::format("it prints '{}' to standard output while it is loaded", *printed));
  return told;
}

std::string describes_itself(const Subject& subject) {
  try {
    static_cast<void>(subject.plugin());
    return {};
  } catch (const PluginError& error) {
    throw Violation(error.what());
  }
}

std::string has_texts(const Subject& subject) {
  const Plugin& plugin = subject.plugin();
  const auto need = [](const char* text, const std::string& what) {
    if (*text == 0) throw Violation(what + " has no text");
  };
  need(plugin.summary, "the plugin");
  need(plugin.version, "its version");
  for (const tofgraph_parameter& p : plugin.own_parameters) need(p.text, fmt::format("parameter '{}'", p.name));
  for (const tofgraph_port& port : plugin.own_ports) {
    if ((port.flags & TOFGRAPH_PORT_EVERY) == 0) need(port.text, fmt::format("port '{}'", port.name));
  }
  return {};
}

std::string keeps_units(const Subject& subject) {
  for (const tofgraph_port& port : subject.plugin().own_ports) {
    for (const std::string& channel : alternatives(port)) {
      const ChannelInfo* known = known_channel(channel);
      if (known == nullptr) continue;
      if (*port.unit != 0 && std::string_view(port.unit) != known->unit)
        throw Violation(fmt::format("its port '{}' has '{}' in '{}', but that channel is in '{}'", port.name, channel,
                                    port.unit, known->unit));
      if (port.type != TOFGRAPH_TYPE_ANY && known->type != TOFGRAPH_TYPE_ANY && port.type != known->type &&
          channel != "flags")
        throw Violation(fmt::format("its port '{}' has '{}' as {}, but that channel is {}", port.name, channel,
                                    element_name(port.type), element_name(known->type)));
    }
  }
  return {};
}

std::string reads_its_values(const Subject& subject) {
  const Plugin& plugin = subject.plugin();
  std::mt19937_64 random(subject.seed);
  std::size_t compared = 0;
  for (const tofgraph_parameter& p : plugin.own_parameters) {
    for (unsigned draw = 0; draw < 20; ++draw) {
      const std::string written = random_value(p, random);
      if (written.empty()) continue;
      Settings settings = settings_of(subject);
      settings[p.name] = written;
      const ParameterValues first = values_of(plugin, settings);
      settings[p.name] = first.text_of(p.name);
      const ParameterValues again = values_of(plugin, settings);
      const std::size_t place = static_cast<std::size_t>(&p - plugin.own_parameters.data());
      const tofgraph_value &a = first.data()[place], &b = again.data()[place];
      const bool same = a.integer == b.integer && std::string_view(a.text) == b.text &&
                        (a.number == b.number || (std::isnan(a.number) && std::isnan(b.number)));
      if (!same) throw Violation(fmt::format("'{}' is written '{}' and read as another value", p.name, written));
      ++compared;
    }
  }
  if (compared == 0) throw NotApplicable("no parameter has a value that can be generated");
  return fmt::format("{} values", compared);
}

std::string takes_values(const Subject& subject) {
  const Plugin& plugin = subject.plugin();
  std::mt19937_64 random(subject.seed);
  std::size_t taken = 0, refused = 0;
  const auto try_with = [&](const std::string& name, const std::string& value) {
    const std::string refusal = or_refuses([&] { make_and_run(subject, {{name, value}}); });
    ++(refusal.empty() ? taken : refused);
  };
  for (const tofgraph_parameter& p : plugin.own_parameters) {
    for (const std::string& bound : bounds_of(p)) try_with(p.name, bound);
    for (const std::string& wrong : wrong_values(p)) {
      const bool word = split_words(p.choices).size() > 1 && p.kind == TOFGRAPH_KIND_NUMBER;
      if (word) continue;
      if (or_refuses([&] { values_of(plugin, settings_of(subject, {{p.name, wrong}})); }).empty())
        throw Violation(fmt::format("'{}' takes '{}', which is beyond its bounds or of another kind", p.name, wrong));
    }
    for (unsigned draw = 0; draw < 4; ++draw) {
      const std::string value = random_value(p, random);
      if (!value.empty()) try_with(p.name, value);
    }
  }
  return fmt::format("{} taken, {} refused", taken, refused);
}

std::string lives_often(const Subject& subject) {
  constexpr int lives = 1000, first = 200, limit = 16;
  std::size_t before = 0;
  if (const std::string refusal = or_refuses([&] { make(subject, {}); }); !refusal.empty())
    throw NotApplicable(refusal);
  for (int i = 0; i < lives; ++i) {
    if (i == first) before = memory_in_use();
    make(subject, {});
  }
  const auto grown = static_cast<std::int64_t>(memory_in_use()) - static_cast<std::int64_t>(before);
  const double each = static_cast<double>(grown) / (lives - first);
  if (each > limit)
    throw Violation(fmt::format("it leaks: {:.0f} bytes are kept each time it is created and destroyed", each));
  return {};
}

}  // namespace tofgraph::conformance
