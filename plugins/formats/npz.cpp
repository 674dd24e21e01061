// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Archives of NumPy arrays (.npz), stored or compressed.
#include <zip.h>
#include <tofgraph/format.hpp>

#include <memory>
#include <sstream>

#include "plugins/formats/npy_array.hpp"

namespace tofgraph {

/// Archive whose members *.npy are arrays; others are ignored, as are those whose elements are not numbers. Members
/// are decompressed only as far as they are read: an archive that announces more than it contains costs nothing.
struct Npz final : FileFormat {
  static constexpr const char* endings = "npz";
  static bool recognises(std::span<const std::uint8_t> head) {
    return head.size() > 4 && head[0] == 'P' && head[1] == 'K' && head[2] == 3 && head[3] == 4;
  }

  explicit Npz(const std::string& path) {
    int error = 0;
    archive_.reset(zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &error));
    if (!archive_) throw std::runtime_error(problem_of(error));
    const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
    for (zip_int64_t i = 0; i < count; ++i) add_member(static_cast<zip_uint64_t>(i));
    if (arrays().empty() && !not_numbers_.empty()) throw std::runtime_error(not_numbers_);
    if (arrays().empty()) throw std::runtime_error("is an archive without .npy files in it");
  }

  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override {
    Member& member = members_[array];
    const FileArray& about = arrays()[array];
    const std::uint64_t slice = about.elements() / about.extent[0] * about.bytes;
    const std::uint64_t begin = member.header.begin + first * slice;
    if (!member.file || member.at > begin) reopen(member);
    std::vector<std::uint8_t> skipped(std::min<std::uint64_t>(begin - member.at, std::uint64_t{1} << 20U));
    while (member.at < begin) next(member, skipped.data(), std::min<std::uint64_t>(begin - member.at, skipped.size()));
    next(member, out, count * slice);
    if (first + count == about.extent[0]) check_end(member);
    to_native(member.header, out, count * slice);
  }

 private:
  struct CloseArchive {
    void operator()(zip_t* archive) const { zip_discard(archive); }
  };
  struct CloseFile {
    void operator()(zip_file_t* file) const { zip_fclose(file); }
  };
  struct Member {
    zip_uint64_t index = 0;
    io::NpyHeader header;
    std::unique_ptr<zip_file_t, CloseFile> file;
    std::uint64_t at = 0;  // number of bytes read
  };

  /// @param error code of libzip
  static const char* problem_of(int error) {
    switch (error) {
      case ZIP_ER_NOZIP:
        return "is a damaged archive: its end is missing, it was cut off";
      case ZIP_ER_OPEN:
        return "cannot be opened: check its permissions";
      case ZIP_ER_READ:
        return "cannot be read: the system reports an error";
      case ZIP_ER_MEMORY:
        return "cannot be read: out of memory";
      case ZIP_ER_COMPNOTSUPP:
        return "has a member whose compression this libzip does not support: save it with numpy.savez_compressed";
      case ZIP_ER_ENCRNOTSUPP:
      case ZIP_ER_NOPASSWD:
        return "has an encrypted member: save it without a password";
      default:
        return "is a damaged archive";
    }
  }

  void reopen(Member& member) {
    member.file.reset(zip_fopen_index(archive_.get(), member.index, 0));
    member.at = 0;
    if (!member.file) throw std::runtime_error(problem_of(zip_error_code_zip(zip_get_error(archive_.get()))));
  }

  void next(Member& member, void* out, std::uint64_t bytes) {
    const zip_int64_t got = zip_fread(member.file.get(), out, bytes);
    if (got < 0 || static_cast<std::uint64_t>(got) != bytes)
      throw std::runtime_error(std::string("is a damaged archive: a member ") +
                               (got < 0 ? "cannot be unpacked" : "ends before its values do"));
    member.at += bytes;
  }

  /// Verifies the checksum of a member, which libzip does at its end.
  static void check_end(Member& member) {
    char more = 0;
    if (zip_fread(member.file.get(), &more, 1) != 0)
      throw std::runtime_error("is a damaged archive: a member does not match its checksum");
    member.file.reset();
  }

  /// Rejects decompression bombs. Deflate reaches 1032 for zeros; measured values compress less than tenfold.
  static void refuse_bomb(const zip_stat_t& about, const std::string& name) {
    constexpr zip_uint64_t large = zip_uint64_t{1} << 30U, most = 200;
    if ((about.valid & ZIP_STAT_COMP_SIZE) == 0 || about.size < large || about.size / most < about.comp_size) return;
    throw std::runtime_error("has the member '" + name + "' of " + std::to_string(about.comp_size) +
                             " bytes, which would become " + std::to_string(about.size) + ", over " +
                             std::to_string(most) +
                             " times as many: no measurement compresses that well. If this is intended, unpack the "
                             "archive, and read the .npy file");
  }

  void add_member(zip_uint64_t index) {
    zip_stat_t about;
    if (zip_stat_index(archive_.get(), index, 0, &about) != 0 || (about.valid & ZIP_STAT_SIZE) == 0)
      throw std::runtime_error("is a damaged archive");
    std::string name = about.name;
    if (!name.ends_with(".npy")) return;
    refuse_bomb(about, name);
    Member member{.index = index};
    reopen(member);
    std::string head(std::min<std::uint64_t>(about.size, 66000), '\0');
    next(member, head.data(), head.size());
    std::istringstream in(head);
    try {
      member.header = io::read_npy_header(in, about.size);
      add(npy_array(member.header, name.substr(0, name.size() - 4), about.size - member.header.begin));
    } catch (const io::NotNumbers& error) {  // texts and notes next to the data
      not_numbers_ = "has the member '" + name + "', which " + error.what();
      return;
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("has the member '" + name + "', which " + error.what());
    }
    members_.push_back(std::move(member));
  }

  std::unique_ptr<zip_t, CloseArchive> archive_;
  std::vector<Member> members_;  // destroyed before the archive
  std::string not_numbers_;      // error text for the last member without numbers
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Npz, "Archives of NumPy's arrays")
