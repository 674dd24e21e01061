// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Point clouds of PCL: text, binary, compressed. PCL's own reader crashes on some damaged files, so only its
// decompression is used.
#include <pcl/io/lzf.h>

#include "plugins/formats/cloud_arrays.hpp"

namespace tofgraph {

struct Pcd final : CloudFormat {
  static constexpr const char* endings = "pcd";
  static bool recognises(std::span<const std::uint8_t> head) {
    const std::string text(head.begin(), head.end());
    return text.starts_with("# .PCD") || (text.starts_with("VERSION") && text.find("\nFIELDS ") != std::string::npos);
  }

  explicit Pcd(const std::string& path) {
    const std::string content = content_of(path);
    read_header(content);
    const std::string_view body = std::string_view(content).substr(body_);
    if (encoding_ == "binary")
      read_binary(body);
    else if (encoding_ == "binary_compressed")
      read_compressed(body);
    else if (!read_text(cloud_, body, "point"))
      cut_off();
    set_cloud(std::move(cloud_), "PCL");
  }

 private:
  void read_header(const std::string& content) {
    std::vector<std::string> names, types;
    std::vector<std::uint64_t> sizes, counts;
    std::uint64_t points = 0;
    bool stated = false;
    for (std::size_t at = 0; encoding_.empty();) {
      const std::size_t end = content.find('\n', at);
      if (end > 65536)  // also if it was not found
        throw std::runtime_error("has no whole PCD header: FIELDS, SIZE, TYPE, WIDTH, HEIGHT, POINTS, DATA");
      Words words(std::string_view(content).substr(at, end - at));
      at = body_ = end + 1;
      const std::string_view key = words.next();
      const auto rest = [&](auto&& take) {
        for (Words probe = words; !probe.next().empty(); probe = words) take();
      };
      if (key == "FIELDS") rest([&] { names.emplace_back(words.next()); });
      if (key == "TYPE") rest([&] { types.emplace_back(words.next()); });
      if (key == "SIZE") rest([&] { sizes.push_back(words.whole_number()); });
      if (key == "COUNT") rest([&] { counts.push_back(words.whole_number()); });
      if (key == "WIDTH") cloud_.width = words.whole_number();
      if (key == "HEIGHT") cloud_.height = words.whole_number();
      if (key == "POINTS") {
        points = words.whole_number();
        stated = true;
      }
      if (key == "DATA") encoding_ = words.next();
    }
    if (encoding_ != "ascii" && encoding_ != "binary" && encoding_ != "binary_compressed")
      throw std::runtime_error("has DATA '" + encoding_.substr(0, 40) + "', expected ascii, binary, binary_compressed");
    if (counts.empty()) counts.assign(names.size(), 1);
    if (names.empty() || sizes.size() != names.size() || types.size() != names.size() || counts.size() != names.size())
      throw std::runtime_error("has FIELDS, SIZE, TYPE and COUNT of different lengths");
    constexpr std::uint64_t max_points = std::uint64_t{1} << 34U;
    if (cloud_.width > max_points || cloud_.height > max_points || cloud_.points() > max_points ||
        (stated && points != cloud_.points()))
      throw std::runtime_error("has POINTS that are not WIDTH x HEIGHT");
    for (std::size_t i = 0; i < names.size(); ++i) add_field(names[i], types[i], sizes[i], counts[i]);
  }

  void add_field(const std::string& name, const std::string& type, std::uint64_t size, std::uint64_t count) {
    const bool known = (type == "F" && (size == 4 || size == 8)) ||
                       ((type == "I" || type == "U") && (size == 1 || size == 2 || size == 4 || size == 8));
    if (!known || count == 0 || count > 1024)
      throw std::runtime_error("has the field '" + name.substr(0, 40) + "' with an unknown TYPE, SIZE or COUNT");
    for (std::uint64_t i = 0; i < count; ++i) {
      CloudField field{.name = count > 1 ? "_" : name, .bytes = static_cast<std::uint32_t>(size)};
      if (type != "F") field.kind = type == "I" ? TOFGRAPH_ELEMENT_SIGNED : TOFGRAPH_ELEMENT_UNSIGNED;
      field.offset = cloud_.step;
      cloud_.step += size;
      cloud_.fields.push_back(field);
    }
  }

  [[noreturn]] void cut_off() const {
    throw std::runtime_error("announces " + std::to_string(cloud_.points()) + " points of " +
                             std::to_string(cloud_.step) + " bytes, more than it holds: it was cut off");
  }

  void read_binary(std::string_view body) {
    if (cloud_.points() > body.size() / cloud_.step) cut_off();
    cloud_.data.assign(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(cloud_.points() * cloud_.step));
  }

  /// Reads fields stored one after the other, compressed with LZF and preceded by two sizes.
  void read_compressed(std::string_view body) {
    std::uint32_t sizes[2] = {};
    if (body.size() < sizeof sizes) cut_off();
    std::memcpy(sizes, body.data(), sizeof sizes);
    constexpr std::uint64_t best_ratio = 300;  // of LZF
    if (sizes[0] > body.size() - sizeof sizes || sizes[1] > best_ratio * sizes[0]) cut_off();
    if (sizes[1] != cloud_.points() * cloud_.step)
      throw std::runtime_error("has compressed points of another size than its header announces");
    std::vector<std::uint8_t> fields(sizes[1]);
    if (pcl::lzfDecompress(body.data() + sizeof sizes, sizes[0], fields.data(), sizes[1]) != sizes[1])
      throw std::runtime_error("has damaged compressed points");
    cloud_.data.resize(fields.size());
    const std::uint8_t* from = fields.data();
    // The components of a field are stored together.
    for (std::size_t i = 0; i < cloud_.fields.size();) {
      std::size_t last = i + 1;
      while (cloud_.fields[i].name == "_" && last < cloud_.fields.size() && cloud_.fields[last].name == "_") ++last;
      const std::uint64_t bytes =
          cloud_.fields[last - 1].offset + cloud_.fields[last - 1].bytes - cloud_.fields[i].offset;
      for (std::uint64_t p = 0; p < cloud_.points(); ++p, from += bytes)
        std::memcpy(&cloud_.data[p * cloud_.step + cloud_.fields[i].offset], from, bytes);
      i = last;
    }
  }

  Cloud cloud_;
  std::string encoding_;
  std::size_t body_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Pcd, "Point clouds of PCL")
