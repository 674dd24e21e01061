// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/log.hpp"

#include "config/silence.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace tofgraph::config {
namespace {

std::atomic<bool> bar_stands = false;

std::mutex one_silence;                         // one SilentLibraries at a time
std::mutex redirection;                         // held while standard error is redirected or a message is written
std::atomic<int> seen_by_user = STDERR_FILENO;  // descriptor read by the user
std::atomic<int> duplicate = -1;                // of standard error; stays open, so that its number is not reused

/// Returns whether standard error is a terminal with colours that are not disabled (https://no-color.org).
bool colours_wanted() {
  const char* no_colour = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  return (no_colour == nullptr || *no_colour == 0) && terminal != nullptr && std::string_view(terminal) != "dumb" &&
         isatty(STDERR_FILENO) != 0;
}

/// Colours `error` and `warning` at the start of a line, or after a position or name there. Lines that begin with a
/// blank (hints and quoted user input) are unchanged.
std::string coloured(std::string_view text) {
  static constexpr std::pair<std::string_view, std::string_view> words[] = {{"error", "\033[1;31m"},
                                                                            {"warning", "\033[1;33m"}};
  std::string result;
  while (!text.empty()) {
    std::string line(text.substr(0, text.find('\n') == std::string_view::npos ? text.size() : text.find('\n') + 1));
    text.remove_prefix(line.size());
    for (const auto& [word, colour] : words) {
      const std::string between = fmt::format(": {}: ", word);
      const bool first = line.starts_with(between.substr(2));
      const std::size_t at = first ? 0 : line.find(between);
      if (at == std::string::npos || line.front() == ' ') continue;
      line.replace(first ? 0 : at + 2, word.size(), fmt::format("{}{}\033[0m", colour, word));
      break;
    }
    result += line;
  }
  return result;
}

}  // namespace

void print_message(const std::string& text) {
  static const bool colours = colours_wanted();
  const std::string line = fmt::format("{}{}{}", bar_stands.exchange(false) ? "\r\033[K" : "",
                                       colours ? coloured(text) : text, text.ends_with('\n') ? "" : "\n");
  const std::scoped_lock lock(redirection);
  for (std::string_view left = line; !left.empty();) {
    const ssize_t written = ::write(standard_error(), left.data(), left.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // standard error is closed: the message cannot be reported otherwise
    left.remove_prefix(static_cast<std::size_t>(written));
  }
}

int standard_error() { return seen_by_user; }

SilentLibraries::SilentLibraries() : alone_(one_silence), words_(memfd_create("words", MFD_CLOEXEC)) {
  const std::scoped_lock lock(redirection);
  const int hidden = words_ >= 0 ? words_ : open("/dev/null", O_WRONLY | O_CLOEXEC);
  const int kept = duplicate < 0 ? fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3) : dup3(STDERR_FILENO, duplicate, O_CLOEXEC);
  if (hidden >= 0 && kept >= 0) {
    seen_by_user = duplicate = kept;
    dup2(hidden, STDERR_FILENO);
  }
  if (words_ < 0 && hidden >= 0) close(hidden);
}

SilentLibraries::~SilentLibraries() {
  const std::scoped_lock lock(redirection);
  if (words_ >= 0) close(words_);
  if (seen_by_user == STDERR_FILENO) return;
  dup2(seen_by_user, STDERR_FILENO);
  seen_by_user = STDERR_FILENO;
}

std::string SilentLibraries::words() const {
  std::string text(std::size_t{1} << 16U, '\0');
  const ssize_t got = seen_by_user == STDERR_FILENO ? -1 : pread(words_, text.data(), text.size(), 0);
  if (got < 0) throw std::runtime_error("what the libraries print cannot be kept: out of files or memory");
  text.resize(static_cast<std::size_t>(got));
  return text;
}

void set_bar_stands(bool stands) { bar_stands = stands; }

std::string counted(std::uint64_t number, std::string_view noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

}  // namespace tofgraph::config
