// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/sha256.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gcrypt.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <vector>

namespace tofgraph::io {
namespace {

/// Closes a file.
class Descriptor {
 public:
  explicit Descriptor(const std::filesystem::path& file) : number_(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (number_ < 0) throw std::runtime_error("cannot read " + file.string());
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(number_); }

  ssize_t fill(std::vector<unsigned char>& block) const {
    ssize_t length = 0;
    do {
      length = read(number_, block.data(), block.size());
    } while (length < 0 && errno == EINTR);
    return length;
  }

 private:
  int number_;
};

/// libgcrypt, which uses the processor's SHA instructions if available.
class Digest {
 public:
  Digest() {
    static const bool ready = [] {
      gcry_check_version(nullptr);
      return gcry_control(GCRYCTL_DISABLE_SECMEM, 0) == 0 && gcry_control(GCRYCTL_INITIALIZATION_FINISHED, 0) == 0;
    }();
    if (!ready || gcry_md_open(&state_, GCRY_MD_SHA256, 0) != 0) throw std::runtime_error("libgcrypt has no SHA-256");
  }
  Digest(const Digest&) = delete;
  Digest& operator=(const Digest&) = delete;
  ~Digest() { gcry_md_close(state_); }

  void add(const unsigned char* bytes, std::size_t count) { gcry_md_write(state_, bytes, count); }
  std::string digits() {
    const unsigned char* bytes = gcry_md_read(state_, GCRY_MD_SHA256);
    std::string text;
    for (std::size_t i = 0; i < 32; ++i) text += fmt::format("{:02x}", bytes[i]);
    return text;
  }

 private:
  gcry_md_hd_t state_ = nullptr;
};

}  // namespace

std::string sha256_of_file(const std::filesystem::path& file, const std::function<bool()>& stopped) {
  const Descriptor input(file);
  Digest digest;
  std::vector<unsigned char> block(std::size_t{1} << 18U);  // about the size of an L2 cache
  for (ssize_t length = 0; (length = input.fill(block)) != 0;) {
    if (length < 0) throw std::runtime_error("cannot read " + file.string());
    if (stopped && stopped()) return {};
    digest.add(block.data(), static_cast<std::size_t>(length));
  }
  return digest.digits();
}

std::string sha256_of(std::string_view bytes) {
  Digest digest;
  digest.add(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  return digest.digits();
}

FileHash::FileHash(std::filesystem::path file) : file_(std::move(file)) { const Descriptor readable(file_); }

const std::string& FileHash::get(const std::function<bool()>& stopped) const {
  std::call_once(made_, [&] {
    try {
      digits_ = sha256_of_file(file_, stopped);
    } catch (const std::runtime_error&) {
      digits_.clear();  // the file was deleted during the run
    }
  });
  return digits_;
}

}  // namespace tofgraph::io
