// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/running_call.hpp"

#include "config/silence.hpp"
#include "graph/instance.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <memory>
#include <new>

namespace tofgraph::graph {
namespace {

/// A nested call (a simulator's effect within the simulator) precedes the outer one.
constexpr std::size_t deepest = 4, max_threads = 256;

struct Entry {
  std::atomic<const Instance*> instance{nullptr};
  std::atomic<const char*> what{nullptr};
  std::atomic<std::uint64_t> frame{0};
  std::atomic<std::int64_t> since_ns{0};
};

struct Thread {
  std::atomic<bool> taken{false};
  std::atomic<std::size_t> depth{0};
  std::array<Entry, deepest> calls;
};

std::array<Thread, max_threads>& threads() {
  static std::array<Thread, max_threads> all;
  return all;
}

/// Slot of this thread; a plain pointer, so that a signal handler may read it.
thread_local Thread* place = nullptr;

/// Reserves a slot for this thread and returns it when the thread ends. With too many threads there is none.
struct Holder {
  Holder() {
    keep_a_stack();
    for (Thread& candidate : threads()) {
      if (candidate.taken.exchange(true)) continue;
      place = &candidate;
      return;
    }
  }
  ~Holder() {
    if (place != nullptr) place->taken = false;
    place = nullptr;
    if (stack_ == nullptr) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, nullptr);
  }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;

 private:
  /// Alternate signal stack, for a thread whose own stack is full. An existing one, e.g. a sanitizer's, is kept.
  void keep_a_stack() {
    stack_t now{};
    if (sigaltstack(nullptr, &now) != 0 || (now.ss_flags & SS_DISABLE) == 0) return;
    const std::size_t size = std::max<std::size_t>(static_cast<std::size_t>(SIGSTKSZ), 32U << 10U);
    stack_.reset(new (std::nothrow) std::byte[size]);  // without memory a call can still be recorded
    if (stack_ == nullptr) return;
    stack_t own{};
    own.ss_sp = stack_.get();
    own.ss_size = size;
    sigaltstack(&own, nullptr);
  }
  std::unique_ptr<std::byte[]> stack_;  // NOLINT(*-avoid-c-arrays)
};

Thread* this_thread() {
  thread_local const Holder holder;
  return place;
}

std::int64_t now_ns() {  // some microseconds late, but almost free of cost
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC_COARSE, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// Builds text without heap memory, for a signal handler.
class Line {
 public:
  Line& operator<<(const char* text) {
    for (; *text != 0 && size_ < sizeof text_; ++text) text_[size_++] = *text;
    return *this;
  }
  Line& operator<<(std::uint64_t number) {
    char digits[20];
    std::size_t count = 0;
    do digits[count++] = static_cast<char>('0' + number % 10);
    while ((number /= 10) != 0);
    while (count > 0 && size_ < sizeof text_) text_[size_++] = digits[--count];
    return *this;
  }
  void write() const { static_cast<void>(!::write(config::standard_error(), text_, size_)); }

 private:
  char text_[2048];
  std::size_t size_ = 0;
};

void describe(Line& line, const Entry& call) {
  const Instance& instance = *call.instance.load();
  const bool effect = instance.plugin().effect != nullptr;
  line << (effect ? "effect '" : "node '") << instance.name().c_str() << "' (" << instance.plugin().name << ")";
  if (const std::uint64_t frame = call.frame.load(); frame != RunningCall::no_frame) line << ", frame " << frame;
  line << ", in " << call.what.load() << "() of plugin " << instance.plugin().file.path.c_str();
}

/// Writes the calls of a thread, innermost first. @returns whether there are any
bool describe_calls(Line& line, const Thread* thread) {
  const std::size_t depth = thread != nullptr ? std::min(thread->depth.load(), deepest) : 0;
  bool others = false;
  for (std::size_t i = depth; i-- > 0;) {
    line << (i + 1 == depth ? ": " : "\n         called by ");
    describe(line, thread->calls[i]);
    others = others || !thread->calls[i].instance.load()->plugin().built_in;
  }
  if (others) line << "\n         tofgraph run --safe runs without plugins that did not come with the program";
  return depth > 0;
}

void on_crash(int number) {
  // The handler runs on the thread that crashed.
  Line line;
  line << "\ntofgraph: error: crashed (signal " << static_cast<std::uint64_t>(number) << ", " << sigdescr_np(number)
       << ")";
  describe_calls(line, place);
  line << "\n";
  line.write();
  std::raise(number);  // the default action is restored: the exit code stays that of the signal
}

}  // namespace

RunningCall::RunningCall(const Instance& instance, const char* what, std::uint64_t frame) : slot_(this_thread()) {
  auto* thread = static_cast<Thread*>(slot_);
  if (thread == nullptr) return;
  const std::size_t depth = thread->depth.load(std::memory_order_relaxed);
  if (depth < deepest) {
    Entry& call = thread->calls[depth];
    call.instance.store(&instance, std::memory_order_relaxed);
    call.what.store(what, std::memory_order_relaxed);
    call.frame.store(frame, std::memory_order_relaxed);
    call.since_ns.store(now_ns(), std::memory_order_relaxed);
  }
  thread->depth.store(depth + 1, std::memory_order_release);
}

RunningCall::~RunningCall() {
  auto* thread = static_cast<Thread*>(slot_);
  if (thread != nullptr)
    thread->depth.store(thread->depth.load(std::memory_order_relaxed) - 1, std::memory_order_release);
}

void install_crash_handler() {
  static_cast<void>(this_thread());
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    struct sigaction action {
    }, before{};
    action.sa_handler = on_crash;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER | SA_ONSTACK);
    sigaction(number, nullptr, &before);
    if (before.sa_handler == SIG_DFL) sigaction(number, &action, nullptr);  // a sanitizer's handler is kept
  }
}

void tell_ending(const char* call, int code) {
  Line line;
  line << "\ntofgraph: error: a library ended the program by " << call << "(" << (code < 0 ? "-" : "")
       << static_cast<std::uint64_t>(code < 0 ? -std::int64_t{code} : code) << ")";
  if (!describe_calls(line, place)) {
    const auto calls = [&line](const Thread& thread) { return describe_calls(line, &thread); };
    static_cast<void>(std::ranges::any_of(threads(), calls));  // the first thread with a running call
  }
  line << "\n";
  line.write();
}

std::vector<std::string> calls_longer_than(double seconds) {
  std::vector<std::string> lines;
  const std::int64_t now = now_ns();
  for (const Thread& thread : threads()) {
    const std::size_t depth = std::min(thread.depth.load(std::memory_order_acquire), deepest);
    if (depth == 0) continue;
    const Entry& outer = thread.calls[0];
    const double running = static_cast<double>(now - outer.since_ns.load(std::memory_order_relaxed)) * 1e-9;
    if (running < seconds) continue;
    const Instance& instance = *outer.instance.load();
    const std::uint64_t frame = outer.frame.load();
    lines.push_back(fmt::format("node '{}' ({}){} has been in {}() for {:.1f} s: plugin {}", instance.name(),
                                instance.plugin().name,
                                frame == RunningCall::no_frame ? "" : fmt::format(", frame {},", frame),
                                outer.what.load(), running, instance.plugin().file.path.string()));
  }
  return lines;
}

}  // namespace tofgraph::graph
