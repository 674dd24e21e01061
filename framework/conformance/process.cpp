// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks that a plugin does not change the state of the whole process.
#include "conformance/trial.hpp"
#include "simulation/files/effect.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <thread>

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace tofgraph::conformance {
namespace {

/// Property of the process in words, and its value.
using State = std::map<std::string, std::string>;

std::string handlers() {
  std::string text;
  for (int signal = 1; signal < 32; ++signal) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) == 0)
      text += fmt::format("{}:{} ", signal, reinterpret_cast<std::uintptr_t>(action.sa_handler));
  }
  return text;
}

std::string blocked_signals() {
  sigset_t set;
  pthread_sigmask(SIG_BLOCK, nullptr, &set);
  std::string text;
  for (int signal = 1; signal < 32; ++signal) text += sigismember(&set, signal) == 1 ? '1' : '0';
  return text;
}

std::string environment() {
  std::string text;
  for (char** variable = environ; *variable != nullptr; ++variable) text += std::string(*variable) + '\n';
  return text;
}

std::string file_mode_mask() {
  const mode_t mask = umask(0);
  umask(mask);
  return fmt::format("{:o}", mask);
}

State settings_of_process() {
  const char* locale = setlocale(LC_ALL, nullptr);
  std::error_code error;
  State state = {{"the locale", locale},
                 {"the working folder", std::filesystem::current_path(error).string()},
                 {"the handlers of signals", handlers()},
                 {"the blocked signals", blocked_signals()},
                 {"the rounding of floating-point numbers", fmt::format("{}", fegetround())},
                 {"the mask of file modes", file_mode_mask()},
                 {"the environment", environment()}};
#ifdef __SSE2__
  constexpr unsigned flags = 0x3f;  // status bits of past operations, not part of the mode
  state["the mode of floating-point numbers"] = fmt::format("{:x}", __builtin_ia32_stmxcsr() & ~flags);
#endif
  return state;
}

std::size_t entries_of(const char* folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  return count;
}

void use(const Subject& subject) {
  if (subject.plugin().effect != nullptr) {
    const io::CameraPtr camera = camera_of(48, 64);
    const graph::ParameterValues values = values_of(subject.plugin(), settings_of(subject));
    const simulation::Effect effect(subject.plugin(), values.data(), camera->view());
    return;
  }
  Trial trial(subject);
  for (std::uint64_t i = 0; i < 3; ++i) {
    tofgraph_frame frame = trial.frame(i);
    if (!trial.process(frame)) break;
  }
  trial.finish();
}

/// Threads joined by the stage may not have disappeared from /proc yet.
bool grew(const char* folder, std::size_t before) {
  for (int wait = 0; wait < 50 && entries_of(folder) > before; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return entries_of(folder) > before;
}

}  // namespace

std::string leaves_the_process(const Subject& subject) {
  const State before = settings_of_process();
  const auto compare = [&before] {
    const State after = settings_of_process();
    for (const auto& [what, value] : before)
      if (after.at(what) != value) throw Violation(fmt::format("it changes {} of the process", what));
  };
  static_cast<void>(subject.plugin());
  compare();
  const auto once = [&] {
    try {
      return or_refuses([&] { use(subject); });
    } catch (const simulation::EffectError& error) {
      return std::string(error.what());
    }
  };
  std::string refusal = once();  // libraries have made their permanent allocations after this call
  compare();
  const std::size_t files = entries_of("/proc/self/fd"), threads = entries_of("/proc/self/task");
  for (int again = 0; again < 3; ++again) once();
  compare();
  if (grew("/proc/self/fd", files)) throw Violation("it leaves files open");
  if (grew("/proc/self/task", threads)) throw Violation("it leaves threads behind");
  return refusal;
}

}  // namespace tofgraph::conformance
