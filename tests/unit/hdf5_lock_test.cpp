// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files are closed with the lock held, also if they cannot be used: Debian's HDF5 is not thread-safe.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <chrono>
#include <future>
#include <thread>

#include "io/captures/array_file.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "tests/program.hpp"

namespace {

bool watched = false;
int closed = 0, unlocked = 0;

bool is_locked() {
  std::promise<void> got;
  std::future<void> lock = got.get_future();
  std::thread([got = std::move(got)]() mutable {
    { const tofgraph::io::h5::Lock other; }
    got.set_value();
  }).detach();
  return lock.wait_for(std::chrono::milliseconds(200)) == std::future_status::timeout;
}

}  // namespace

/// Called instead of HDF5's function by the library under test.
extern "C" __attribute__((visibility("default"))) herr_t H5Fclose(hid_t file) {
  if (watched) {
    ++closed;
    if (!is_locked()) ++unlocked;
  }
  return reinterpret_cast<herr_t (*)(hid_t)>(dlsym(RTLD_NEXT, "H5Fclose"))(file);
}

namespace tofgraph::tests {
namespace {

class Hdf5Lock : public testing::Test {
 protected:
  Hdf5Lock() {
    H5Fclose(H5Fcreate(file_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
    closed = unlocked = 0;
    watched = true;
  }
  ~Hdf5Lock() override { watched = false; }

  void expect_locked() const {
    EXPECT_EQ(closed, 1);
    EXPECT_EQ(unlocked, 0);
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "empty.h5";  ///< without any object: opened, but of no use
};

TEST_F(Hdf5Lock, HeldWhenACaptureIsRejected) {
  io::run_trial_once(file_, "capture", {"/bin/true"});
  EXPECT_THROW(io::CaptureReader{file_}, std::runtime_error);
  expect_locked();
}

TEST_F(Hdf5Lock, HeldWhenAnArrayFileIsRejected) {
  io::run_trial_once(file_, "arrays", {"/bin/true"});
  EXPECT_THROW(io::ArrayFile{file_}, std::runtime_error);
  expect_locked();
}

}  // namespace
}  // namespace tofgraph::tests
