#include "tools/commands/arguments.hpp"

#include <iostream>

#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include "base/text/times.hpp"
#include "fabric/messages.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands {

namespace {

fabric::CallId parse_call(const std::string& text) {
  const auto call = fabric::parse_call_id(text);
  if (!call) {
    throw CLI::ValidationError(
        fmt::format("'{}' is not a call id; expected one as in 5f3a9c0112d4-17", text));
  }
  return *call;
}

/// An option whose text `parse` turns into a value or an error.
template <typename Value, typename Parse>
CLI::Option* add_parsed(CLI::App& command, const std::string& name, Value& value,
                        const std::string& description, const std::string& type, Parse parse) {
  return command
      .add_option_function<std::string>(
          name,
          [&value, parse](const std::string& text) {
            auto parsed = parse(text);
            if (!parsed) {
              throw CLI::ValidationError(parsed.error());
            }
            value = *parsed;
          },
          description)
      ->type_name(type);
}

tl::expected<fabric::Time, std::string> time_of(const std::string& text) {
  return base::text::parse_time(text, std::chrono::system_clock::now());
}

}  // namespace

CLI::Option* add_call(CLI::App& command, const std::string& name, fabric::CallId& call,
                      const std::string& description) {
  return command
      .add_option_function<std::string>(
          name, [&call](const std::string& text) { call = parse_call(text); }, description)
      ->type_name("CALL");
}

CLI::Option* add_duration(CLI::App& command, const std::string& name,
                          std::chrono::nanoseconds& duration, const std::string& description) {
  return add_parsed(command, name, duration, description, "DURATION", base::text::parse_time_span);
}

CLI::Option* add_size(CLI::App& command, const std::string& name, std::uint64_t& size,
                      const std::string& description) {
  return add_parsed(command, name, size, description, "SIZE", print::parse_size);
}

void add_machine_filter(CLI::App& command, recording::Filter& filter) {
  command.add_option("--machine", filter.machines, "Only this machine; may be repeated");
}

void add_uuid_filter(CLI::App& command, recording::Filter& filter) {
  command.add_option_function<std::vector<std::string>>(
      "--uuid",
      [&filter](const std::vector<std::string>& uuids) {
        for (const std::string& uuid : uuids) {
          filter.uuids.insert(fabric::canonical_uuid(uuid));
        }
      },
      "Only this service; may be repeated");
}

void add_filter(CLI::App& command, recording::Filter& filter) {
  add_machine_filter(command, filter);
  command.add_option("--channel", filter.channels, "Only this channel; may be repeated");
  add_uuid_filter(command, filter);
}

void add_recording_filter(CLI::App& command, recording::Filter& filter) {
  add_filter(command, filter);
  command
      .add_option("--kind", filter.kinds,
                  "Only entries of this kind, as `recording cat` names them")
      ->check(
          CLI::IsMember({"request", "reply", "withdrawal", "channel", "instance", "status", "event",
                         "command", "outcome", "machine", "data", "program", "alarm"}));
  add_time_filter(command, filter);
}

void add_time_filter(CLI::App& command, recording::Filter& filter) {
  command
      .add_option_function<std::string>(
          "--call", [&filter](const std::string& text) { filter.call = parse_call(text); },
          "Only this call")
      ->type_name("CALL");
  add_parsed(command, "--from", filter.from, "Only what was recorded at or after this time", "TIME",
             time_of);
  add_parsed(command, "--to", filter.to, "Only what was recorded at or before this time", "TIME",
             time_of);
}

namespace {

/// Switches the echo of a terminal off while it lives.
class Unseen {
 public:
  explicit Unseen(const std::string& prompt) {
    if (::tcgetattr(STDIN_FILENO, &before_) == 0) {
      is_terminal_ = true;
      termios unseen = before_;
      unseen.c_lflag &= ~static_cast<tcflag_t>(ECHO);
      ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &unseen);
      fmt::print(stderr, "{}: ", prompt);
    }
  }
  ~Unseen() {
    if (is_terminal_) {
      ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
      fmt::print(stderr, "\n");
    }
  }
  Unseen(const Unseen&) = delete;
  Unseen& operator=(const Unseen&) = delete;

 private:
  bool is_terminal_ = false;
  termios before_{};
};

}  // namespace

std::string read_hidden(const std::string& prompt) {
  const Unseen unseen(prompt);
  std::string line;
  std::getline(std::cin, line);
  return line;
}

}  // namespace millrace::tools::commands
