// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/command_line.hpp"

#include "config/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace tofgraph::cli {
namespace {

class Help : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string& value = option->get_option_text();
    return fmt::format("{}{}{}", value.empty() ? "" : " ", value,
                       option->get_required() && !option->get_positional() ? " (required)" : "");
  }

  /// The options of a command are followed by those of all commands.
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override {
    const CLI::App* all = app;
    while (all->get_parent() != nullptr) all = all->get_parent();
    const std::string own = Formatter::make_subcommands(app, mode);
    if (all == app) return own;
    return own + make_group("Options of all commands", false, all->get_options([all](const CLI::Option* option) {
             return option != all->get_help_ptr() && option != all->get_version_ptr();
           }));
  }
};

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// ", did you mean 'x'?", or nothing.
std::string guess(const std::string& word, const std::vector<std::string>& known) {
  const std::string near = config::nearest(word, known);
  return near.empty() ? "" : fmt::format(", did you mean '{}'?", near);
}

/// First example in the help of the chosen command, or of the program.
std::string example_of(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const std::string footer = (chosen.empty() ? app : *chosen.front()).get_footer();
  const std::size_t start = footer.find("tofgraph ", std::min(footer.find("Example"), footer.size()));
  if (start == std::string::npos) return "";
  return "\n         example: " + footer.substr(start, footer.find('\n', start) - start);
}

/// Text without its ending if it has that ending, else nothing.
std::string before(const std::string& text, std::string_view ending) {
  return text.ends_with(ending) ? text.substr(0, text.size() - ending.size()) : "";
}

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_in_words() { return std::make_shared<Help>(); }

std::string unknown_word(const CLI::App& app) {
  const std::vector<std::string> rest = app.remaining(true);
  if (rest.empty()) return {};
  const std::string word = rest.front().substr(0, rest.front().find('='));
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const std::string command = chosen.empty() ? "" : " " + chosen.front()->get_name();
  if (word.starts_with("-")) {
    std::vector<std::string> known = options_of(app);
    for (const CLI::App* one : chosen) {
      const std::vector<std::string> own = options_of(*one);
      if (std::ranges::find(own, word) != own.end())
        return fmt::format("error: '{}' is an option of '{}': write it after that word", word, one->get_name());
      for (std::string& name : options_of(*one)) known.push_back(std::move(name));
    }
    const std::string near = guess(word, known);
    return fmt::format("error: there is no option '{}'{}", word,
                       near.empty() ? fmt::format("\n         options: tofgraph{} --help", command) : near);
  }
  if (!chosen.empty())
    return fmt::format("error: '{}' is one argument too many\n         arguments: tofgraph{} --help", rest.front(),
                       command);
  std::vector<std::string> commands;
  for (const CLI::App* one : app.get_subcommands([](const CLI::App*) { return true; }))
    commands.push_back(one->get_name());
  const std::string near = guess(rest.front(), commands);
  return fmt::format("error: there is no command '{}'{}", rest.front(),
                     near.empty() ? "\n         " + config::suggestion(rest.front(), commands, "commands") : near);
}

std::string usage_problem(const CLI::App& app, const CLI::ParseError& error) {
  std::string text = error.what();
  if (const std::string missing = before(text, " is required"); !missing.empty()) {
    text = (missing == "A subcommand" ? "the command" : missing) + " is missing";
  } else if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const bool none = !before(text, " missing").empty();
    text = fmt::format("{} {}", text.substr(0, text.find(':')), none ? "needs a value" : "is given more than once");
  }
  return fmt::format("error: {}{}", text, example_of(app));
}

CLI::Validator whole_number(std::int64_t minimum, std::int64_t maximum) {
  const auto problem = [=](const std::string& text) -> std::string {
    std::int64_t number = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool whole = failed == std::errc() && end == text.data() + text.size();
    if (whole && number >= minimum && number <= maximum) return {};
    const bool limited = maximum != std::numeric_limits<std::int64_t>::max();
    return fmt::format(
        "'{}' is not a whole number {}", text,
        limited ? fmt::format("from {} to {}", minimum, maximum) : fmt::format("of at least {}", minimum));
  };
  return {problem, ""};
}

CLI::Validator one_of(std::vector<std::string> words) {
  const auto problem = [words = std::move(words)](const std::string& text) -> std::string {
    if (std::ranges::find(words, text) != words.end()) return {};
    const std::string near = guess(text, words);
    return fmt::format("'{}' is unknown{}", text,
                       near.empty() ? fmt::format(", expected {}", fmt::join(words, ", ")) : near);
  };
  return {problem, ""};
}

}  // namespace tofgraph::cli
