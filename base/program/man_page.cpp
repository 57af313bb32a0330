#include <algorithm>
#include <cctype>
#include <string_view>

#include <fmt/format.h>

#include "base/program/command_tree.hpp"

namespace millrace::base::program {

namespace {

/// Escapes a text for roff, so that no part of it is a request or an escape.
std::string shown(std::string_view text) {
  std::string out;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) {
      out += "\\&";
    }
    begins = c == '\n';
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out;
}

/// The same with line breaks kept.
std::string lines(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    out += (out.empty() ? "" : ".br\n") + shown(text.substr(0, end)) + "\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::string bold(std::string_view text) {
  return fmt::format("\\fB{}\\fR", shown(text));
}

std::string italic(std::string_view text) {
  return fmt::format("\\fI{}\\fR", shown(text));
}

/// The first line of a description, without the name at the beginning of some.
std::string summary(const Command& command) {
  std::string text = command.description.substr(0, command.description.find('\n'));
  if (const std::string name = command.words + ": "; text.starts_with(name)) {
    text.erase(0, name.size());
  }
  return text;
}

std::string in_capitals(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return c == ' ' ? '-' : static_cast<char>(std::toupper(c));
  });
  return text;
}

std::string synopsis(const Command& command) {
  std::string text = bold(command.words);
  if (!command.options.empty()) {
    text += " [" + italic("OPTIONS") + "]";
  }
  for (const CommandOption& option : command.options) {
    if (option.names.empty()) {
      const std::string name = italic(option.value) + (option.repeated ? " ..." : "");
      text += option.required ? " " + name : " [" + name + "]";
    }
  }
  if (!command.commands.empty()) {
    text += " " + italic("COMMAND");
  }
  return text;
}

std::string option_entry(const CommandOption& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += (names.empty() ? "" : ", ") + bold(name);
  }
  if (!option.value.empty()) {
    names += (names.empty() ? "" : " ") + italic(option.value);
  }
  std::string text = lines(option.description);
  const auto add_line = [&text](const std::string& line) {
    text += (text.empty() ? "" : ".br\n") + shown(line) + "\n";
  };
  if (!option.words.empty()) {
    add_line(fmt::format("One of {}.", fmt::join(option.words, ", ")));
  }
  if (!option.initial.empty()) {
    add_line(fmt::format("Default: {}.", option.initial));
  }
  if (option.required && !option.names.empty()) {
    add_line("Required.");
  }
  return fmt::format(".TP\n{}\n{}", names, text.empty() ? "\\&\n" : text);
}

std::string options_of(const Command& command) {
  std::string text;
  for (const CommandOption& option : command.options) {
    text += option_entry(option);
  }
  return text;
}

/// The examples, with their lines unchanged.
std::string footer_of(const Command& command) {
  return command.footer.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", shown(command.footer));
}

void add_commands(const Command& command, std::string& text) {
  for (const Command& each : command.commands) {
    text += fmt::format(".SS {}\n{}.PP\n{}\n{}{}", shown(each.words), lines(each.description),
                        synopsis(each), options_of(each), footer_of(each));
    add_commands(each, text);
  }
}

constexpr std::string_view common = R"(.SH "EXIT STATUS"
.TP
0
The work is done.
.TP
1
The work was understood but failed; standard error says why.
.TP
2
A wrong flag, value or configuration: nothing was started.
.SH ENVIRONMENT
Programs that join a fabric:
.TP
.B MILLRACE_FABRIC_CONFIG
The configuration of the fabric; \fI/etc/millrace/fabric.textproto\fR if it is not set and that file is there.
.TP
.BR MILLRACE_DOMAIN ", " MILLRACE_FABRIC
The DDS domain and the name of the fabric in it.
)";

}  // namespace

std::string man_page(const Command& command, const std::string& version) {
  std::string text = fmt::format(
      ".TH \"{}\" \"1\" \"\" \"millrace {}\" \"millrace\"\n.nh\n.ad l\n.SH NAME\n{} \\- {}\n.SH "
      "SYNOPSIS\n{}\n",
      shown(in_capitals(command.words)), shown(version), shown(command.words),
      shown(summary(command)), synopsis(command));
  text += ".SH DESCRIPTION\n" + lines(command.description);
  text += ".SH OPTIONS\n" + options_of(command);
  if (!command.commands.empty()) {
    text += ".SH COMMANDS\n";
    add_commands(command, text);
  }
  if (!command.footer.empty()) {
    text += ".SH EXAMPLES\n" + footer_of(command);
  }
  return text + std::string(common);
}

}  // namespace millrace::base::program
