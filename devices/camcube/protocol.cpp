// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <sstream>

#include "config/document.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph::camcube {
namespace {

using config::Diagnostics;
using config::Value;

constexpr std::string_view number_types[] = {"u8", "u16le", "u16be", "u32le", "u32be", "u64le", "u64be"};
constexpr std::string_view command_names[] = {"identify", "integration_time", "modulation_frequency", "start", "stop"};

std::vector<std::string> words_of(std::span<const std::string_view> words) { return {words.begin(), words.end()}; }

/// Decimal, or hexadecimal after 0x.
std::optional<std::uint64_t> whole(std::string_view text, int base = 10) {
  if (text.starts_with("0x")) {
    base = 16;
    text.remove_prefix(2);
  }
  std::uint64_t number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (failed != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Byte given by two hexadecimal digits.
std::optional<std::uint8_t> hex_byte(const std::string& word) {
  const auto number = word.size() == 2 ? whole(word, 16) : std::nullopt;
  return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
}

class ProtocolReader {
 public:
  explicit ProtocolReader(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  Protocol read(const Value& document) {
    Protocol protocol;
    config::check_version(document, "protocol", 1, diagnostics_);
    config::Reader reader(document, diagnostics_, "the protocol description");
    reader.take("protocol");
    protocol.name = reader.word("name", "");
    if (const config::Entry* device = reader.need("device", "{vendor: 0x1c28, product: 0xc003}")) {
      config::Reader ids(device->value, diagnostics_, "the device");
      protocol.vendor = static_cast<std::uint16_t>(number(ids, "vendor", "0x1c28", {}, 0, 0xffff));
      protocol.product = static_cast<std::uint16_t>(number(ids, "product", "0xc003", {}, 0, 0xffff));
      ids.finish();
    }
    protocol.interface = static_cast<int>(number(reader, "interface", "0", 0, 0, 31));
    protocol.endpoint = static_cast<std::uint8_t>(number(reader, "endpoint", "0x82", {}, 0x81, 0x8f));
    protocol.transfers = number(reader, "transfers", "8", 8, 1, 64);
    const std::vector<std::string> messages = {"image", "frame"};
    protocol.whole_frames = reader.choice("message", messages) == "frame";
    if (const config::Entry* fields = reader.take("fields")) read_fields(fields->value, protocol);
    if (!protocol.whole_frames && !protocol.image && !protocol.number)
      diagnostics_.error(
          document.at,
          "images come one by one, and their headers have neither 'image' nor 'number': nobody would see "
          "where a frame begins",
          "example: fields: {image: {offset: 4, type: u8}}, or message: frame");
    if (const config::Entry* commands = reader.take("commands")) read_commands(commands->value, protocol);
    reader.finish();
    return protocol;
  }

 private:
  std::uint64_t number(config::Reader& reader, std::string_view key, std::string_view example,
                       std::optional<std::uint64_t> default_value, std::uint64_t least, std::uint64_t most) {
    const config::Entry* entry = default_value ? reader.take(key) : reader.need(key, example);
    if (entry == nullptr) return default_value.value_or(least);
    const auto value = entry->value.is_scalar() ? whole(entry->value.text) : std::nullopt;
    if (value && *value >= least && *value <= most) return *value;
    diagnostics_.error(entry->value.at,
                       fmt::format("'{}' is {}, expected a whole number from {} to {} ({:#x} to {:#x})", key,
                                   entry->value.described(), least, most, least, most),
                       fmt::format("example: {}: {}", key, example));
    return least;
  }

  NumberType type_named(const std::string& name, const config::Position& at) {
    const auto known = std::ranges::find(number_types, name);
    if (known == std::end(number_types)) {
      const std::vector<std::string> all = words_of(number_types);
      diagnostics_.error(at, fmt::format("there is no type '{}'", name), config::suggestion(name, all, "types"));
      return {};
    }
    return {*whole(name.substr(1, name.find_first_not_of("0123456789", 1) - 1)) / 8, name.ends_with("be")};
  }

  std::vector<std::uint8_t> bytes_in(const Value& value, std::string_view key) {
    std::vector<std::uint8_t> bytes;
    std::istringstream words(value.is_scalar() ? value.text : "");
    bool right = value.is_scalar();
    for (std::string word; words >> word;) {
      const auto byte = hex_byte(word);
      right = right && byte;
      if (byte) bytes.push_back(*byte);
    }
    if (!right || bytes.empty())
      diagnostics_.error(value.at,
                         fmt::format("'{}' is {}, expected bytes of two hexadecimal digits", key, value.described()),
                         fmt::format("example: {}: 54 46 0a", key));
    return bytes;
  }

  void check_end(const Value& value, std::size_t offset, std::size_t bytes) {
    if (offset + bytes > RawSourceData::header_bytes)
      diagnostics_.error(value.at, fmt::format("this is beyond the header's {} bytes: {} from {} on",
                                               RawSourceData::header_bytes, bytes, offset));
  }

  std::optional<Field> field(config::Reader& fields, std::string_view key) {
    const config::Entry* entry = fields.take(key);
    if (entry == nullptr) return std::nullopt;
    config::Reader reader(entry->value, diagnostics_, fmt::format("the field '{}'", key));
    Field result;
    result.offset = number(reader, "offset", "8", {}, 0, RawSourceData::header_bytes - 1);
    if (const config::Entry* type = reader.need("type", "u32le"))
      result.type = type_named(type->value.text, type->value.at);
    reader.finish();
    check_end(entry->value, result.offset, result.type.bytes);
    return result;
  }

  void read_fields(const Value& value, Protocol& protocol) {
    config::Reader fields(value, diagnostics_, "'fields'");
    if (const config::Entry* entry = fields.take("magic")) {
      config::Reader reader(entry->value, diagnostics_, "the field 'magic'");
      Magic magic;
      magic.offset = number(reader, "offset", "0", {}, 0, RawSourceData::header_bytes - 1);
      if (const config::Entry* bytes = reader.need("bytes", "54 46")) magic.bytes = bytes_in(bytes->value, "bytes");
      reader.finish();
      check_end(entry->value, magic.offset, magic.bytes.size());
      protocol.magic = magic;
    }
    protocol.image = field(fields, "image");
    protocol.number = field(fields, "number");
    protocol.integration_time = field(fields, "integration_time");
    protocol.modulation_frequency = field(fields, "modulation_frequency");
    fields.finish();
  }

  void read_commands(const Value& value, Protocol& protocol) {
    config::Reader commands(value, diagnostics_, "'commands'");
    for (const std::string_view name : command_names) {
      const config::Entry* entry = commands.take(name);
      if (entry == nullptr) continue;
      if (!entry->value.is_list() || entry->value.items.empty()) {
        diagnostics_.error(entry->value.at,
                           fmt::format("the command '{}' is {}, expected a list of transfers", name,
                                       entry->value.is_list() ? "empty" : entry->value.described()),
                           "example: - {bulk: 0x01, data: 01 00}");
        continue;
      }
      for (const Value& item : entry->value.items) protocol.commands[std::string(name)].push_back(step(item));
    }
    commands.finish();
  }

  Step step(const Value& value) {
    config::Reader reader(value, diagnostics_, "a transfer");
    Step step;
    const config::Entry* control = reader.take("control");
    const config::Entry* bulk = value.find("bulk");
    if ((control == nullptr) == (bulk == nullptr))
      diagnostics_.error(value.at, "a transfer is either 'control' or 'bulk'",
                         "example: {control: [0x40, 0xb1, 1, 0]} or {bulk: 0x01, data: 01 00}");
    if (control != nullptr) step.control = setup_packet(control->value);
    step.bulk = static_cast<std::uint8_t>(number(reader, "bulk", "0x01", 0, bulk != nullptr ? 1 : 0, 0x0f));
    const bool in = step.control && ((*step.control)[0] & 0x80U) != 0;
    if (const config::Entry* data = reader.take("data")) {
      step.data = parts(data->value);
      if (in) diagnostics_.error(data->at, "a transfer to the host (request type 0x80 and more) sends no data");
    } else if (bulk != nullptr) {
      diagnostics_.error(value.at, "a bulk transfer has no 'data'", "example: {bulk: 0x01, data: 01 00}");
    }
    if (const config::Entry* answer = reader.take("answer")) {
      step.answer = bytes_in(answer->value, "answer");
      if (!in) diagnostics_.error(answer->at, "only a control transfer to the host has an answer");
    }
    reader.finish();
    return step;
  }

  std::array<std::uint16_t, 4> setup_packet(const Value& value) {
    std::array<std::uint16_t, 4> packet{};
    bool right = value.is_list() && value.items.size() == packet.size();
    for (std::size_t i = 0; right && i < packet.size(); ++i) {
      const auto number = whole(value.items[i].text);
      right = number && *number <= (i < 2 ? 0xffU : 0xffffU);
      if (right) packet[i] = static_cast<std::uint16_t>(*number);
    }
    if (!right)
      diagnostics_.error(value.at, "expected request type, request (a byte each), value, index (two bytes each)",
                         "example: control: [0x40, 0xb1, 1, 0]");
    return packet;
  }

  std::vector<Step::Part> parts(const Value& value) {
    std::vector<Step::Part> result;
    std::istringstream words(value.is_scalar() ? value.text : "");
    for (std::string word; words >> word;) {
      const auto colon = word.find(':');
      Step::Part part;
      if (colon == std::string::npos) {
        if (const auto byte = hex_byte(word)) part.bytes = {*byte};
      } else {
        const std::string name = word.substr(0, colon);
        if (name == "integration_time") part.value = &CommandValues::integration_time_us;
        if (name == "modulation_frequency") part.value = &CommandValues::modulation_frequency_hz;
        part.type = type_named(word.substr(colon + 1), value.at);
      }
      if (part.bytes.empty() && part.value == nullptr)
        diagnostics_.error(value.at,
                           fmt::format("'{}' is neither a byte nor integration_time or modulation_frequency "
                                       "with a type",
                                       word),
                           "example: data: 01 integration_time:u32le");
      result.push_back(part);
    }
    if (result.empty()) diagnostics_.error(value.at, "'data' is empty", "example: data: 01 integration_time:u32le");
    return result;
  }

  Diagnostics& diagnostics_;
};

}  // namespace

std::uint64_t read_number(NumberType type, std::span<const std::uint8_t> at) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < type.bytes; ++i) number = number << 8U | at[type.big_endian ? i : type.bytes - 1 - i];
  return number;
}

std::vector<std::uint8_t> Step::bytes(const CommandValues& values) const {
  std::vector<std::uint8_t> result;
  for (const Part& part : data) {
    result.insert(result.end(), part.bytes.begin(), part.bytes.end());
    if (part.value == nullptr) continue;
    const std::uint64_t number = values.*part.value;
    if (part.type.bytes < 8 && number >> (8 * part.type.bytes) != 0)
      throw std::out_of_range(fmt::format("{} does not fit into the {} bytes of the command", number, part.type.bytes));
    for (std::size_t i = 0; i < part.type.bytes; ++i) {
      const std::size_t shift = 8 * (part.type.big_endian ? part.type.bytes - 1 - i : i);
      result.push_back(static_cast<std::uint8_t>(number >> shift));
    }
  }
  return result;
}

Protocol read_protocol(const std::filesystem::path& file) {
  Diagnostics diagnostics;
  Protocol protocol = ProtocolReader(diagnostics).read(config::load_document(file));
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  protocol.file = file;
  return protocol;
}

}  // namespace tofgraph::camcube
