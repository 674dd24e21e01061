// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/diagnostics.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

namespace tofgraph::config {
namespace {

std::string line_of(const std::string& text, std::size_t line) {
  std::size_t begin = 0;
  for (std::size_t i = 1; i < line; ++i) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return {};
    ++begin;
  }
  return text.substr(begin, text.find('\n', begin) - begin);
}

std::string shown(const Diagnostic& d) {
  std::string out;
  if (d.at.source) {
    out += d.at.source->name;
    if (d.at.line > 0) out += fmt::format(":{}:{}", d.at.line, d.at.column);
    out += ": ";
  }
  out += d.severity == Severity::error ? "error: " : "warning: ";
  out += d.message;
  if (!d.message.ends_with('\n')) out += '\n';  // the message may contain those of another file
  if (d.at.source && d.at.line > 0) {
    const std::string line = line_of(d.at.source->text, d.at.line);
    const std::size_t before = std::min(d.at.column - 1, line.size());
    std::string indent = line.substr(0, before);
    for (char& c : indent) c = c == '\t' ? '\t' : ' ';
    const std::size_t length = std::clamp<std::size_t>(d.at.length, 1, std::max<std::size_t>(line.size() - before, 1));
    out += fmt::format("{:6} | {}\n       | {}^{}\n", d.at.line, line, indent, std::string(length - 1, '~'));
  }
  if (!d.hint.empty()) out += fmt::format("         {}\n", d.hint);
  return out;
}

/// Edit distance that counts a transposition as one edit (optimal string alignment).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

}  // namespace

void Diagnostics::error(const Position& at, std::string message, std::string hint) {
  all_.push_back({Severity::error, at, std::move(message), std::move(hint)});
  ++errors_;
}

void Diagnostics::warning(const Position& at, std::string message, std::string hint) {
  all_.push_back({Severity::warning, at, std::move(message), std::move(hint)});
}

void Diagnostics::add(const ConfigurationError& failure, const Position& at) {
  if (failure.mistakes().empty()) error(at, failure.what());
  add(failure.mistakes());
}

void Diagnostics::add(const std::vector<Diagnostic>& mistakes) {
  for (const Diagnostic& mistake : mistakes) {
    all_.push_back(mistake);
    if (mistake.severity == Severity::error) ++errors_;
  }
}

std::string Diagnostics::text() const {
  std::vector<const Diagnostic*> order;
  std::vector<const SourceText*> sources;  // in the order of their first error
  for (const Diagnostic& d : all_) {
    order.push_back(&d);
    if (std::ranges::find(sources, d.at.source.get()) == sources.end()) sources.push_back(d.at.source.get());
  }
  std::ranges::stable_sort(order, {}, [&](const Diagnostic* d) {
    return std::tuple(std::ranges::find(sources, d->at.source.get()), d->at.line, d->at.column);
  });
  std::string out;
  for (const Diagnostic* d : order) out += shown(*d);
  return out;
}

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(name.size() / 3, 1) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t d = distance(name, candidate);
    if (d < best_distance) {
      best = candidate;
      best_distance = d;
    }
  }
  return best;
}

std::string suggestion(std::string_view name, std::span<const std::string> candidates, std::string_view what) {
  const std::string near = nearest(name, candidates);
  if (!near.empty()) return fmt::format("did you mean '{}'?", near);
  return candidates.empty() ? fmt::format("there are no {}", what)
                            : fmt::format("{}: {}", what, fmt::join(candidates, ", "));
}

}  // namespace tofgraph::config
