// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/manual.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

/// Escapes text for roff.
std::string roff(std::string_view text) {
  std::string result;
  bool start = true;
  for (const char c : text) {
    if (start && (c == '.' || c == '\'')) result += "\\&";
    start = c == '\n';
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

std::string options_section(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : shown_options(command))
    text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(option_words(*option)), roff(option->get_description()));
  return text;
}

std::string usage_of(const CLI::App& command, const std::string& name) {
  std::string text = fmt::format(".B {}\n[\\fIOPTIONS\\fR]", roff(name));
  for (const CLI::Option* option : shown_options(command))
    if (option->get_positional())
      text += fmt::format(fmt::runtime(option->get_required() ? " \\fI{}\\fR" : " [\\fI{}\\fR]"),
                          roff(option_words(*option)));
  return text + "\n";
}

std::string footer_section(const CLI::App& command) {
  return command.get_footer().empty() ? "" : fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(command.get_footer()));
}

std::string man_page(const CLI::App& command, const std::string& name, const std::string& see_also) {
  std::string file = name, title = name;
  std::ranges::replace(file, ' ', '-');
  std::ranges::transform(file, title.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string text =
      fmt::format(".TH {} 1 \"\" \"tofgraph {}\" \"tofgraph\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}", roff(title),
                  TOFGRAPH_VERSION, roff(file), roff(command.get_description()), usage_of(command, name));
  text += ".SH OPTIONS\n" + options_section(command);
  for (const CLI::App* sub : shown_commands(command)) {
    if (command.get_parent() == nullptr)
      text += fmt::format("{}.TP\n\\fB{}\\fR\n{}\n", sub == shown_commands(command).front() ? ".SH COMMANDS\n" : "",
                          roff(sub->get_name()), roff(sub->get_description()));
    else
      text += fmt::format(".SH \"{}\"\n{}.PP\n{}.\n{}.PP\n.nf\n{}\n.fi\n", roff(sub->get_name()),
                          usage_of(*sub, name + " " + sub->get_name()), roff(sub->get_description()),
                          options_section(*sub), roff(sub->get_footer()));
  }
  return text + footer_section(command) + ".SH \"SEE ALSO\"\n" + see_also + "\n";
}

/// Option names followed by the words allowed in their position: subcommands.
std::vector<std::string> words_of(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : shown_options(command)) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    for (const std::string& name : option->get_snames()) words.push_back("-" + name);
  }
  for (const CLI::App* sub : shown_commands(command)) words.push_back(sub->get_name());
  return words;
}

/// Calls a function for every command with its words, e.g. "camera new".
template <class Call> void for_each_command(const CLI::App& app, Call&& call) {
  for (const CLI::App* command : shown_commands(app)) {
    call(command->get_name(), *command);
    for (const CLI::App* sub : shown_commands(*command)) call(command->get_name() + " " + sub->get_name(), *sub);
  }
}

std::string bash_completion(const CLI::App& app) {
  const std::string common = fmt::format("{}", fmt::join(words_of(app), " "));
  std::string text =
      "# Completion of tofgraph for bash, made from its declarations.\n_tofgraph() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} command=''\n  local word\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    [[ $word == -* ]] && continue\n"
      "    case \"$command${command:+ }$word\" in\n";
  std::string known, cases;
  for_each_command(app, [&](const std::string& name, const CLI::App& command) {
    known += fmt::format("{}'{}'", known.empty() ? "" : " | ", name);
    cases += fmt::format("    '{}') words='{}' ;;\n", name, fmt::join(words_of(command), " "));
  });
  text += fmt::format("      {}) command=\"$command${{command:+ }}$word\" ;;\n    esac\n  done\n", known);
  text += fmt::format("  local words='{}'\n  case $command in\n{}  esac\n", common, cases);
  return text +
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  [[ -z $command || $current == -* ]] || COMPREPLY+=($(compgen -f -- \"$current\"))\n}\n"
         "complete -o filenames -F _tofgraph tofgraph\n";
}

/// Escapes a description in an argument of zsh's _arguments or _values.
std::string zsh_text(std::string text) {
  text.resize(std::min(text.find('\n'), text.size()));
  std::string result;
  for (const char c : text) {
    if (c == '\'')
      result += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      result += std::string("\\") + c;
    else
      result += c;
  }
  return result;
}

std::string zsh_options(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : shown_options(command)) {
    const std::string& value = option->get_option_text();
    for (const std::string& name : option->get_lnames())
      text += fmt::format(" \\\n    '--{}[{}]{}'", name, zsh_text(option->get_description()),
                          value.empty() ? "" : fmt::format(":{}:_files", zsh_text(value)));
  }
  return text;
}

std::string zsh_completion(const CLI::App& app) {
  std::string text =
      "#compdef tofgraph\n# Completion of tofgraph for zsh, made from its declarations.\n_tofgraph() {\n";
  text += "  local command=${words[2]} sub=${words[3]}\n  if (( CURRENT == 2 )); then\n    _values command";
  for (const CLI::App* command : shown_commands(app))
    text += fmt::format(" \\\n      '{}[{}]'", command->get_name(), zsh_text(command->get_description()));
  text += "\n    return\n  fi\n  case \"$command $sub\" in\n";
  std::string general;
  for_each_command(app, [&](const std::string& name, const CLI::App& command) {
    const bool nested = name.find(' ') != std::string::npos;
    std::string subs;
    for (const CLI::App* sub : shown_commands(command))
      subs += fmt::format(" '{}[{}]'", sub->get_name(), zsh_text(sub->get_description()));
    const std::string body = subs.empty() ? fmt::format("_arguments{} \\\n    '*:file:_files'", zsh_options(command))
                                          : "_values command" + subs;
    (nested ? text : general) += fmt::format("  '{}{}) {} ;;\n", name, nested ? "'" : " '*", body);
  });
  return text + general + "  esac\n}\n_tofgraph \"$@\"\n";
}

}  // namespace

std::vector<const CLI::Option*> shown_options(const CLI::App& command) {
  std::vector<const CLI::Option*> shown;
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_group().empty()) shown.push_back(option);
  }
  return shown;
}

std::string option_words(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true);
  std::string names = option.get_name(false, true);
  std::string words;
  for (const char c : names) words += c == ',' ? ", " : std::string(1, c);
  const std::string& value = option.get_option_text();
  return value.empty() ? words : words + " " + value;
}

std::vector<const CLI::App*> shown_commands(const CLI::App& command) {
  std::vector<const CLI::App*> shown;
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (!sub->get_group().empty()) shown.push_back(sub);
  }
  return shown;
}

void write_manual(const CLI::App& app, const fs::path& folder) {
  const fs::path man = folder / "man" / "man1";
  for (const fs::path& one : {man, folder / "bash-completion/completions", folder / "zsh/vendor-completions"})
    fs::create_directories(one);
  std::string pages;
  for (const CLI::App* command : shown_commands(app)) {
    pages += fmt::format("{}\n.BR tofgraph\\-{} (1)", pages.empty() ? "" : ",", roff(command->get_name()));
    io::write_file(man / fmt::format("tofgraph-{}.1", command->get_name()),
                   man_page(*command, "tofgraph " + command->get_name(), ".BR tofgraph (1)"));
  }
  io::write_file(man / "tofgraph.1", man_page(app, "tofgraph", pages.substr(1)));
  io::write_file(folder / "bash-completion/completions/tofgraph", bash_completion(app));
  io::write_file(folder / "zsh/vendor-completions/_tofgraph", zsh_completion(app));
}

}  // namespace tofgraph::cli
