// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/child_process.hpp"

#include <unistd.h>
#include <uv.h>

#include <array>
#include <csignal>
#include <ctime>
#include <stdexcept>

namespace tofgraph::config {
namespace {

template <class T> uv_handle_t* handle(T& one) { return reinterpret_cast<uv_handle_t*>(&one); }
template <class T> uv_stream_t* stream(T& one) { return reinterpret_cast<uv_stream_t*>(&one); }

/// What a child does not read any more would end this process: in this thread the signal is put off and thrown away.
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

/// One child on a loop of its own, so that any thread may run one.
class Child {
 public:
  explicit Child(const ChildOptions& options) : options_(options) {
    uv_loop_init(&loop_);
    uv_timer_init(&loop_, &timer_);
    for (uv_pipe_t* pipe : {&in_, &out_, &err_}) uv_pipe_init(&loop_, pipe, 0);
    for (uv_handle_t* one : {handle(timer_), handle(in_), handle(out_), handle(err_), handle(process_)})
      one->data = this;
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    uv_walk(
        &loop_, [](uv_handle_t* one, void*) { close(one); }, nullptr);
    uv_run(&loop_, UV_RUN_DEFAULT);
    uv_loop_close(&loop_);
  }

  ChildResult run(std::vector<std::string>& command) {
    start(command);
    uv_read_start(stream(out_), memory, received);
    if (options_.keep_errors) uv_read_start(stream(err_), memory, received);
    send();
    if (options_.patience.count() > 0) {
      const auto patience = static_cast<std::uint64_t>(options_.patience.count());
      uv_timer_start(&timer_, silent, patience, patience);
      uv_unref(handle(timer_));
    }
    uv_run(&loop_, UV_RUN_DEFAULT);
    return std::move(result_);
  }

 private:
  static void close(uv_handle_t* one) {
    if (uv_is_closing(one) == 0) uv_close(one, nullptr);
  }
  static Child& self(void* data) { return *static_cast<Child*>(data); }

  void start(std::vector<std::string>& command) {
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const auto flags = [](int wanted) { return static_cast<uv_stdio_flags>(wanted); };
    std::array<uv_stdio_container_t, 3> ends{};
    ends[0].flags = flags(UV_CREATE_PIPE | UV_READABLE_PIPE);
    ends[0].data.stream = stream(in_);
    ends[1].flags = flags(UV_CREATE_PIPE | UV_WRITABLE_PIPE);
    ends[1].data.stream = stream(out_);
    ends[2].flags = flags(options_.keep_errors ? UV_CREATE_PIPE | UV_WRITABLE_PIPE : UV_INHERIT_FD);
    if (options_.keep_errors)
      ends[2].data.stream = stream(err_);
    else
      ends[2].data.fd = STDERR_FILENO;
    uv_process_options_t wanted{};
    wanted.file = arguments.front();
    wanted.args = arguments.data();
    wanted.stdio = ends.data();
    wanted.stdio_count = static_cast<int>(ends.size());
    wanted.exit_cb = [](uv_process_t* process, std::int64_t exit_code, int signal) {
      self(process->data).result_.exit_code = exit_code;
      self(process->data).result_.signal = signal;
      close(handle(*process));
    };
    if (const int error = uv_spawn(&loop_, &process_, &wanted); error != 0)
      throw std::runtime_error(uv_strerror(error));
  }

  void send() {
    sent_.data = this;
    uv_buf_t text = uv_buf_init(const_cast<char*>(options_.input.data()), static_cast<unsigned>(options_.input.size()));
    // A child that reads nothing more has its reason, which its exit code tells.
    const auto done = [](uv_write_t* sent, int) { close(handle(self(sent->data).in_)); };
    if (options_.input.empty() || uv_write(&sent_, stream(in_), &text, 1, done) != 0) close(handle(in_));
  }

  static void memory(uv_handle_t* pipe, std::size_t, uv_buf_t* block) {
    *block = uv_buf_init(self(pipe->data).block_.data(), static_cast<unsigned>(self(pipe->data).block_.size()));
  }

  static void received(uv_stream_t* pipe, ssize_t length, const uv_buf_t* block) {
    Child& child = self(pipe->data);
    std::string& text = pipe == stream(child.out_) ? child.result_.output : child.result_.errors;
    if (length > 0) text.append(block->base, static_cast<std::size_t>(length));
    if (length < 0) close(reinterpret_cast<uv_handle_t*>(pipe));
    if (uv_is_active(handle(child.timer_)) != 0) uv_timer_again(&child.timer_);
  }

  static void silent(uv_timer_t* timer) { self(timer->data).options_.on_silence(self(timer->data).result_.output); }

  const ChildOptions& options_;
  ChildResult result_;
  std::array<char, 65536> block_{};
  uv_loop_t loop_{};
  uv_timer_t timer_{};
  uv_pipe_t in_{}, out_{}, err_{};
  uv_process_t process_{};
  uv_write_t sent_{};
};

}  // namespace

ChildResult run_child(std::vector<std::string> command, const ChildOptions& options) {
  const WithoutSigpipe quiet;
  return Child(options).run(command);
}

}  // namespace tofgraph::config
