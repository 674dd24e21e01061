// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/child_process.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "tests/unit/full_disk.hpp"

namespace tofgraph::config {
namespace {

ChildResult shell_says(const std::string& script, const ChildOptions& options = {}) {
  return run_child({"sh", "-c", script}, options);
}

TEST(Child, GivesWhatItWroteAndHowItEnded) {
  const ChildResult said = shell_says("echo one; echo two >&2; exit 7", {.keep_errors = true});
  EXPECT_EQ(said.output, "one\n");
  EXPECT_EQ(said.errors, "two\n");
  EXPECT_EQ(said.exit_code, 7);
  EXPECT_EQ(said.signal, 0);
  EXPECT_FALSE(said.ok());
  EXPECT_EQ(shell_says("kill -SEGV $$").signal, SIGSEGV);
}

TEST(Child, TakesAndGivesMoreThanAPipeHolds) {
  std::string much;
  while (much.size() < 3'000'000) much += std::to_string(much.size()) + "\n";
  const ChildResult said = run_child({"cat"}, {.input = much});
  EXPECT_TRUE(said.ok());
  EXPECT_TRUE(said.output == much);
}

TEST(Child, OneThatReadsNothingEndsNobody) {
  const ChildResult said = shell_says("exec <&-; sleep 0.1; echo done", {.input = std::string(1'000'000, 'x')});
  EXPECT_EQ(said.output, "done\n");
  sigset_t pending;
  sigpending(&pending);
  EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
}

TEST(Child, SaysWhyItCannotBeStarted) {
  EXPECT_EQ(tests::thrown([] { run_child({"/nowhere/at/all"}); }), "No such file or directory");
  EXPECT_EQ(tests::thrown([] { run_child({"/etc/passwd"}); }), "Permission denied");
}

TEST(Child, TellsOfSilence) {
  std::string heard = "never";
  int times = 0;
  const auto on_silence = [&](const std::string& output) {
    heard = output;
    ++times;
  };
  shell_says("echo begun; sleep 0.5", {.patience = std::chrono::milliseconds(200), .on_silence = on_silence});
  EXPECT_EQ(heard, "begun\n");
  EXPECT_GE(times, 1);
}

/// Programs that embed the library have their own handling of SIGCHLD.
TEST(Child, EndsWhereSigchldIsBlockedAndLeavesAHandlerAlone) {
  static std::atomic<int> told{0};
  struct sigaction own {
  }, before{}, after{};
  own.sa_handler = [](int) { ++told; };
  sigaction(SIGCHLD, &own, &before);
  EXPECT_EQ(shell_says("exit 3").exit_code, 3);
  EXPECT_EQ(told, 1);
  sigset_t child, mask;
  sigemptyset(&child);
  sigaddset(&child, SIGCHLD);
  pthread_sigmask(SIG_BLOCK, &child, &mask);
  EXPECT_EQ(shell_says("echo heard; exit 4").output, "heard\n");
  pthread_sigmask(SIG_SETMASK, &mask, nullptr);
  sigaction(SIGCHLD, nullptr, &after);
  EXPECT_EQ(after.sa_handler, own.sa_handler);
  sigaction(SIGCHLD, &before, nullptr);
}

TEST(Child, WithoutDescriptorsIsAnError) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = 4;
  setrlimit(RLIMIT_NOFILE, &few);
  const std::string why = tests::thrown([] { shell_says("true"); });
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(why, "Too many open files");
}

/// A pipe inherited by another child would remain open after it is closed here.
TEST(Child, ManyAtOnceEndEachAtItsOwnTime) {
  std::vector<std::thread> threads;
  std::atomic<int> right{0};
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&right, i] {
      for (int k = 0; k < 10; ++k) {
        const std::string text = std::to_string(i * 100 + k);
        right += run_child({"cat"}, {.input = text}).output == text ? 1 : 0;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 80);
}

}  // namespace
}  // namespace tofgraph::config
