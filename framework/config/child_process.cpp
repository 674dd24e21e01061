// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Uses posix_spawn and poll: works for any SIGCHLD handling of the host program, and on any of its threads.
#include "config/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace tofgraph::config {
namespace {

/// Blocks and discards SIGPIPE in this thread: writing to a child that has stopped reading would end this process.
class WithoutSigpipe {
 public:
  WithoutSigpipe() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &set_, &before_);
  }
  WithoutSigpipe(const WithoutSigpipe&) = delete;
  WithoutSigpipe& operator=(const WithoutSigpipe&) = delete;
  ~WithoutSigpipe() {
    const timespec at_once{};
    while (sigtimedwait(&set_, nullptr, &at_once) == SIGPIPE) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t set_{}, before_{};
};

[[noreturn]] void fail(int error) { throw std::runtime_error(std::strerror(error)); }

/// End of a pipe.
class End {
 public:
  End() = default;
  explicit End(int number) : number_(number) {}
  End(End&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  End& operator=(End&& other) noexcept {
    close();
    number_ = std::exchange(other.number_, -1);
    return *this;
  }
  End(const End&) = delete;
  End& operator=(const End&) = delete;
  ~End() { close(); }

  int number() const { return number_; }
  bool is_open() const { return number_ >= 0; }
  void close() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }

 private:
  int number_ = -1;
};

struct Pipe {
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail(errno);
    read = End(ends[0]);
    write = End(ends[1]);
  }
  End read, write;
};

class Child {
 public:
  Child(std::vector<std::string>& command, const ChildOptions& options) : options_(options) {
    Pipe in, out, err;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in.read.number(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out.write.number(), STDOUT_FILENO);
    if (options.keep_errors) posix_spawn_file_actions_adddup2(&actions, err.write.number(), STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, pipe;
    sigemptyset(&none);
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &pipe);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int error = posix_spawnp(&pid_, arguments.front(), &actions, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) fail(error);
    in_ = std::move(in.write);
    out_ = std::move(out.read);
    if (options.keep_errors) err_ = std::move(err.read);
    fcntl(in_.number(), F_SETFL, O_NONBLOCK);
  }

  ChildResult run() {
    if (options_.input.empty()) in_.close();
    while ((out_.is_open() || err_.is_open()) && !result_.overtime) exchange();
    in_.close();
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0) {
      if (errno != EINTR) return std::move(result_);  // the host ignores SIGCHLD, so the exit status is lost
    }
    if (WIFSIGNALED(status)) result_.signal = WTERMSIG(status);
    if (WIFEXITED(status)) result_.exit_code = WEXITSTATUS(status);
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Timeout of poll() in ms: until on_silence or the time limit; -1: none.
  int patience() const {
    std::chrono::milliseconds wait = options_.patience;
    if (options_.limit.count() > 0) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(options_.limit - (Clock::now() - start_));
      const auto some = std::max(left, std::chrono::milliseconds(1));
      wait = wait.count() > 0 ? std::min(wait, some) : some;
    }
    return wait.count() > 0 ? static_cast<int>(wait.count()) : -1;
  }

  /// Writes to the child's input and reads its outputs, whichever is ready.
  void exchange() {
    std::array<pollfd, 3> ends = {{{in_.number(), POLLOUT, 0}, {out_.number(), POLLIN, 0}, {err_.number(), POLLIN, 0}}};
    const int ready = poll(ends.data(), ends.size(), patience());
    if (options_.limit.count() > 0 && Clock::now() - start_ >= options_.limit) {
      result_.overtime = kill(pid_, SIGKILL) == 0;  // grandchildren may survive and are not waited for
      return;
    }
    if (ready == 0 && options_.on_silence) options_.on_silence(result_.output);
    if (ready <= 0) return;
    if (ends[0].revents != 0) feed();
    if (ends[1].revents != 0) drain(out_, result_.output);
    if (ends[2].revents != 0) drain(err_, result_.errors);
  }

  /// Writes input. A child that stops reading is not an error here; its exit code states the reason.
  void feed() {
    const ssize_t sent = write(in_.number(), options_.input.data() + sent_, options_.input.size() - sent_);
    if (sent > 0) sent_ += static_cast<std::size_t>(sent);
    if ((sent < 0 && errno != EAGAIN && errno != EINTR) || sent_ == options_.input.size()) in_.close();
  }

  void drain(End& end, std::string& text) {
    const ssize_t length = read(end.number(), block_.data(), block_.size());
    if (length > 0) text.append(block_.data(), static_cast<std::size_t>(length));
    if (length == 0 || (length < 0 && errno != EINTR)) end.close();
  }

  const ChildOptions& options_;
  const Clock::time_point start_ = Clock::now();
  ChildResult result_;
  pid_t pid_ = 0;
  End in_, out_, err_;
  std::size_t sent_ = 0;
  std::array<char, 65536> block_{};
};

}  // namespace

ChildResult run_child(std::vector<std::string> command, const ChildOptions& options) {
  const WithoutSigpipe quiet;
  return Child(command, options).run();
}

}  // namespace tofgraph::config
