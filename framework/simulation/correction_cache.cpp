// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/correction_cache.hpp"

#include "config/paths.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <fstream>
#include <iterator>
#include <mutex>
#include <type_traits>

namespace tofgraph::simulation {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view table_magic = "tofgraph-correction-1";
constexpr std::size_t hash_digits = 64;
constexpr std::size_t kept_in_memory = 16;            // tables
constexpr std::uintmax_t kept_on_disk = 512U << 20U;  // bytes, of all cameras and models

/// Reads and writes the same fields in the same order.
struct TableWriter {
  std::string bytes{};
  template <class T> void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void operator()(const std::vector<float>& values) {
    (*this)(values.size());
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  }
  void operator()(const std::vector<std::vector<float>>& lists) {
    (*this)(lists.size());
    for (const std::vector<float>& list : lists) (*this)(list);
  }
};

struct TableReader {
  std::string_view bytes;
  bool good = true;
  template <class T> void operator()(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    copy(&value, sizeof value);
  }
  void operator()(std::vector<float>& values) {
    values.resize(count(sizeof(float)));
    copy(values.data(), values.size() * sizeof(float));
  }
  void operator()(std::vector<std::vector<float>>& lists) {
    lists.resize(count(sizeof(std::size_t)));
    for (std::vector<float>& list : lists) (*this)(list);
  }

 private:
  void copy(void* to, std::size_t size) {
    good = good && size <= bytes.size();
    if (!good || size == 0) return;
    std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
  }
  /// Reads a number of elements and checks that the remaining bytes can hold them.
  std::size_t count(std::size_t element) {
    std::size_t n = 0;
    (*this)(n);
    good = good && n <= bytes.size() / element;
    return good ? n : 0;
  }
};

template <class Tables, class Visit> void visit_fields(Tables& t, Visit& visit) {
  visit(t.needs);
  visit(t.integration_time);
  visit(t.modulation_frequency);
  visit(t.ends);
  visit(t.steps);
  visit(t.lanes);
  visit(t.distances);
  visit(t.amplitudes);
  visit(t.first);
  visit(t.step);
  visit(t.range);
  visit(t.shifts);
  visit(t.weakest);
  visit(t.strongest);
  visit(t.pixels);
  visit(t.corners);
  visit(t.worst);
}

struct KeptTables {
  std::string key;
  std::shared_ptr<const CorrectionTables> tables;
};

/// Tables compiled or read by this process, oldest first.
class TableMemory {
 public:
  std::shared_ptr<const CorrectionTables> find(const std::string& key, const FrameSettings& settings) {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find_if(
        kept_, [&](const KeptTables& kept) { return kept.key == key && kept.tables->covers(settings); });
    return found != kept_.end() ? found->tables : nullptr;
  }
  void keep(const std::string& key, std::shared_ptr<const CorrectionTables> tables) {
    const std::lock_guard lock(mutex_);
    if (kept_.size() == kept_in_memory) kept_.pop_front();
    kept_.push_back({key, std::move(tables)});
  }

 private:
  std::mutex mutex_;
  std::deque<KeptTables> kept_;
};

TableMemory& table_memory() {
  static TableMemory memory;
  return memory;
}

std::string bytes_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Removes the oldest files if the total exceeds the limit.
void prune(const fs::path& folder) {
  struct Stored {
    fs::file_time_type time;
    std::uintmax_t size;
    fs::path path;
  };
  std::vector<Stored> files;
  std::uintmax_t total = 0;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error)) continue;
    files.push_back({entry.last_write_time(error), entry.file_size(error), entry.path()});
    total += files.back().size;
  }
  std::ranges::sort(files, {}, &Stored::time);
  for (const Stored& file : files) {
    if (total <= kept_on_disk) return;
    fs::remove(file.path, error);
    total -= file.size;
  }
}

}  // namespace

std::string to_bytes(const CorrectionTables& tables) {
  TableWriter write{std::string(table_magic)};
  visit_fields(tables, write);
  return write.bytes + io::sha256_of(write.bytes);
}

std::shared_ptr<const CorrectionTables> tables_from_bytes(const std::string& bytes) {
  if (bytes.size() < table_magic.size() + hash_digits || !bytes.starts_with(table_magic)) return nullptr;
  const std::string_view body = std::string_view(bytes).substr(0, bytes.size() - hash_digits);
  if (io::sha256_of(body) != std::string_view(bytes).substr(body.size())) return nullptr;
  TableReader read{body.substr(table_magic.size())};
  auto tables = std::make_shared<CorrectionTables>();
  visit_fields(*tables, read);
  return read.good && read.bytes.empty() ? tables : nullptr;
}

CorrectionCache::CorrectionCache(std::string key) : key_(std::move(key)) {
  if (const fs::path cache = config::cache_folder(); !cache.empty()) folder_ = cache / "corrections" / key_;
}

std::shared_ptr<const CorrectionTables> CorrectionCache::find(const FrameSettings& settings) const {
  if (auto tables = table_memory().find(key_, settings)) return tables;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    auto tables = tables_from_bytes(bytes_of_file(entry.path()));
    if (!tables || !tables->covers(settings)) continue;
    table_memory().keep(key_, tables);
    return tables;
  }
  return nullptr;
}

void CorrectionCache::keep(const std::shared_ptr<const CorrectionTables>& tables) const {
  table_memory().keep(key_, tables);
  if (folder_.empty()) return;
  try {
    const std::string bytes = to_bytes(*tables);
    io::OutputFile file(folder_ / bytes.substr(bytes.size() - hash_digits));
    file.write(bytes);
    file.commit();
    prune(folder_.parent_path());
  } catch (const std::exception&) {  // disk full or read-only folder
  }
}

}  // namespace tofgraph::simulation
