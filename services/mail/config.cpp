#include "services/mail/config.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "base/configuration/mistakes.hpp"
#include "base/posix/system.hpp"
#include "base/text/cp1252.hpp"
#include "idl/mail.pb.h"
#include "services/mail/compose.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::mail {

namespace {

// Reads and checks the rules of mail.textproto.

/// `config` has the recipients. Records every mistake with its place.
std::vector<Rule> read_rules(const config::Mail& from, const Config& config,
                             base::configuration::Mistakes& mistakes);

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;
using fabric::ProgramEventKind;

ProgramEventKind kind_of_event(int event) {
  switch (event) {
    case config::Mail::Rule::STARTED:
      return ProgramEventKind::started;
    case config::Mail::Rule::ENDED:
      return ProgramEventKind::ended;
    case config::Mail::Rule::RESET:
      return ProgramEventKind::reset;
    case config::Mail::Rule::ON_HOLD:
      return ProgramEventKind::on_hold;
    default:
      return ProgramEventKind::aborted;
  }
}

const char* default_subject(Rule::Kind kind) {
  switch (kind) {
    case Rule::Kind::program:
      return "{machine}/{channel}: program {program} {event}";
    case Rule::Kind::waits:
      return "{machine}/{channel} waits";
    case Rule::Kind::link_down:
      return "{machine}: no link";
    case Rule::Kind::no_instance:
      return "no instance of {uuid}";
  }
  return "";
}

const char* default_text(Rule::Kind kind) {
  switch (kind) {
    case Rule::Kind::program:
      return "Program {program} of {machine}, channel {channel}: {event} at {time} after "
             "{duration} "
             "s. Error: {error}. Parts: {parts}.\n{reason}\n";
    case Rule::Kind::waits:
      return "{machine}, channel {channel} is {state} since {since}: {reason}\nService: {uuid}\n";
    case Rule::Kind::link_down:
      return "There is no link to {machine} since {since}: {reason}\n";
    case Rule::Kind::no_instance:
      return "No instance of {uuid} is ready since {since}.\n";
  }
  return "";
}

/// Reads one rule.
class RuleReader {
 public:
  RuleReader(const config::Mail::Rule& from, const Config& config, ConfigPath path,
             Mistakes& mistakes)
      : from_(from), config_(config), path_(std::move(path)), mistakes_(mistakes) {}

  std::optional<Rule> read() {
    constexpr std::uint32_t a_day = 86'400;
    const int given = (from_.program_size() > 0 ? 1 : 0) + (from_.has_waits_s() ? 1 : 0) +
                      (from_.has_link_down_s() ? 1 : 0) + (from_.has_no_instance_of() ? 1 : 0);
    if (!mistakes_.expect(given == 1, path_,
                          "a rule has one of program, waits_s, link_down_s and no_instance_of")) {
      return std::nullopt;
    }
    const Rule::Kind kind = kind_of_rule();
    for (const auto& [is_there, value, name] :
         {std::tuple(from_.has_waits_s(), from_.waits_s(), "waits_s"),
          std::tuple(from_.has_link_down_s(), from_.link_down_s(), "link_down_s"),
          std::tuple(from_.has_no_instance_of(), from_.no_instance_s(), "no_instance_s")}) {
      if (is_there) {
        mistakes_.expect_range(value, 1U, a_day, path_ / name);
      }
    }
    mistakes_.expect_range(from_.quiet_s(), 0U, a_day, path_ / "quiet_s");
    mistakes_.expect(kind != Rule::Kind::no_instance || from_.machine_size() == 0,
                     path_ / "machine", "a service has no machine");
    const std::string uuid = fabric::canonical_uuid(from_.no_instance_of());
    mistakes_.expect(kind != Rule::Kind::no_instance || !uuid.empty(), path_ / "no_instance_of",
                     "is empty; expected the UUID of a service");
    check_recipients();
    auto subject = text_of(from_.subject(), default_subject(kind), "subject");
    auto text = text_of(from_.text(), default_text(kind), "text");
    mistakes_.expect(from_.subject().find_first_of("\r\n") == std::string::npos, path_ / "subject",
                     "has more than one line");
    if (!subject || !text) {
      return std::nullopt;
    }
    Rule rule{.subject = std::move(*subject), .text = std::move(*text)};
    rule.name = from_.name();
    rule.kind = kind;
    for (const int event : from_.program()) {
      rule.events.insert(kind_of_event(event));
    }
    rule.after = std::chrono::seconds(from_.has_waits_s()       ? from_.waits_s()
                                      : from_.has_link_down_s() ? from_.link_down_s()
                                                                : from_.no_instance_s());
    rule.uuid = uuid;
    rule.machines = {from_.machine().begin(), from_.machine().end()};
    rule.to = {from_.to().begin(), from_.to().end()};
    rule.quiet = std::chrono::seconds(from_.quiet_s());
    return rule;
  }

 private:
  [[nodiscard]] Rule::Kind kind_of_rule() const {
    if (from_.has_waits_s()) {
      return Rule::Kind::waits;
    }
    if (from_.has_link_down_s()) {
      return Rule::Kind::link_down;
    }
    return from_.has_no_instance_of() ? Rule::Kind::no_instance : Rule::Kind::program;
  }

  void check_recipients() {
    mistakes_.expect(from_.to_size() > 0, path_ / "to", "is missing; expected a recipient");
    for (int i = 0; i < from_.to_size(); ++i) {
      mistakes_.expect(config_.recipients.contains(from_.to(i)), path_ / ConfigStep{"to", i},
                       "'" + from_.to(i) + "' is not a recipient");
    }
  }

  std::optional<Template> text_of(const std::string& given, const char* otherwise,
                                  const char* field) {
    const ConfigPath path = path_ / field;
    mistakes_.expect(base::text::is_utf8(given), path, "is not UTF-8");
    auto parsed = Template::parse(given.empty() ? otherwise : given);
    if (!mistakes_.expect(parsed.has_value(), path, parsed ? "" : parsed.error())) {
      return std::nullopt;
    }
    for (const std::string& key : parsed->keys()) {
      mistakes_.expect(
          rule_keys().contains(key), path,
          fmt::format("{{{}}} does not exist; known are {}", key, fmt::join(rule_keys(), " ")));
    }
    return *std::move(parsed);
  }

  const config::Mail::Rule& from_;
  const Config& config_;
  ConfigPath path_;
  Mistakes& mistakes_;
};

std::vector<Rule> read_rules(const config::Mail& from, const Config& config, Mistakes& mistakes) {
  std::vector<Rule> rules;
  std::set<std::string> names;
  for (int i = 0; i < from.rule_size(); ++i) {
    const ConfigPath path{{"rule", i}};
    const std::string& name = from.rule(i).name();
    mistakes.expect(text::is_name(name), path / "name",
                    fmt::format("'{}'; expected 1 to 32 letters, digits, '_' or '-'", name));
    mistakes.expect(names.insert(name).second, path / "name",
                    fmt::format("'{}' occurs twice", name));
    if (auto rule = RuleReader(from.rule(i), config, path, mistakes).read()) {
      rules.push_back(std::move(*rule));
    }
  }
  return rules;
}

namespace fs = std::filesystem;

/// Reads the valid fields and records the mistakes.
class Reader {
 public:
  Reader(const config::Mail& from, const fs::path& folder, Mistakes& mistakes)
      : from_(from), folder_(folder), mistakes_(mistakes) {}

  Config read() {
    read_server();
    if (mistakes_.expect(!from_.from().empty(), {{"from"}}, "is missing")) {
      take_address(from_.from(), {{"from"}},
                   [&](Address address) { config_.from = std::move(address); });
    }
    read_recipients();
    read_templates();
    config_.rules = read_rules(from_, config_, mistakes_);
    read_retry();
    config_.spool = beside(from_.spool());
    return std::move(config_);
  }

 private:
  [[nodiscard]] fs::path beside(const std::string& name) const {
    return (folder_ / name).lexically_normal();
  }

  template <typename Take>
  void take_address(const std::string& text, const ConfigPath& path, Take take) {
    auto address = parse_address(text);
    if (mistakes_.expect(address.has_value(), path, address ? "" : address.error())) {
      take(*std::move(address));
    }
  }

  void read_server() {
    const config::Mail::Server& from = from_.server();
    const ConfigPath path{{"server"}};
    const auto is_bad = [](char c) { return c <= ' ' || c == 0x7F; };
    const auto is_word = [&](const std::string& text) {
      return std::none_of(text.begin(), text.end(), is_bad);
    };
    mistakes_.expect(!from.host().empty() && is_word(from.host()), path / "host",
                     "is missing or not a name");
    mistakes_.expect_range<std::uint32_t>(from.port(), 1, std::numeric_limits<std::uint16_t>::max(),
                                          path / "port");
    mistakes_.expect(from.connect_timeout_ms() > 0, path / "connect_timeout_ms",
                     "0; expected 1 or more");
    mistakes_.expect(from.timeout_ms() > 0, path / "timeout_ms", "0; expected 1 or more");
    const bool file = !from.password_file().empty();
    const bool environment = !from.password_env().empty();
    mistakes_.expect(from.user().empty() ? !file && !environment : file != environment, path,
                     "needs password_file or password_env with user, and none without");
    mistakes_.expect(from.user().empty() || from.starttls() != config::Mail::OFF, path / "user",
                     "needs starttls: REQUIRED or IMPLICIT, or the password could be read on the "
                     "way");
    constexpr std::uint16_t port_of_implicit_tls = 465;
    const bool implicit = from.starttls() == config::Mail::IMPLICIT;
    const Security unencrypted =
        from.starttls() == config::Mail::OFF ? Security::none : Security::starttls;
    config_.server = {.host = from.host(),
                      .port = implicit && !from.has_port()
                                  ? port_of_implicit_tls
                                  : static_cast<std::uint16_t>(from.port()),
                      .security = implicit ? Security::tls : unencrypted,
                      .ca_file = from.ca_file().empty() ? fs::path() : beside(from.ca_file()),
                      .user = from.user(),
                      .password_file = file ? beside(from.password_file()) : fs::path(),
                      .password_env = from.password_env(),
                      .connect_timeout = std::chrono::milliseconds(from.connect_timeout_ms()),
                      .timeout = std::chrono::milliseconds(from.timeout_ms())};
  }

  void read_recipients() {
    mistakes_.expect(from_.recipient_size() > 0, {{"recipient"}},
                     "is missing; expected one or more");
    for (int i = 0; i < from_.recipient_size(); ++i) {
      const config::Mail::Recipient& from = from_.recipient(i);
      const ConfigPath path{{"recipient", i}};
      check_name(from.name(), path / "name", config_.recipients.contains(from.name()));
      mistakes_.expect(from.address_size() > 0, path / "address", "is missing");
      auto& addresses = config_.recipients[from.name()];
      for (int j = 0; j < from.address_size(); ++j) {
        take_address(from.address(j), path / ConfigStep{"address", j},
                     [&](Address address) { addresses.push_back(std::move(address)); });
      }
    }
  }

  void read_templates() {
    mistakes_.expect(from_.template__size() + from_.rule_size() > 0, {{"template"}},
                     "is missing; expected one or more, or a rule");
    for (int i = 0; i < from_.template__size(); ++i) {
      const config::Mail::Template& from = from_.template_(i);
      const ConfigPath path{{"template", i}};
      check_name(from.name(), path / "name", config_.templates.contains(from.name()));
      for (int j = 0; j < from.to_size(); ++j) {
        mistakes_.expect(config_.recipients.contains(from.to(j)), path / ConfigStep{"to", j},
                         "'" + from.to(j) + "' is not a recipient");
      }
      mistakes_.expect(!from.subject().empty(), path / "subject", "is missing");
      mistakes_.expect(from.subject().find_first_of("\r\n") == std::string::npos, path / "subject",
                       "has more than one line");
      auto subject = text_of(from.subject(), path / "subject");
      auto text = text_of(from.text(), path / "text");
      if (subject && text) {
        config_.templates.insert_or_assign(from.name(),
                                           MailTemplate{.to = {from.to().begin(), from.to().end()},
                                                        .subject = *std::move(subject),
                                                        .text = *std::move(text)});
      }
    }
  }

  void check_name(const std::string& name, const ConfigPath& path, bool is_there) {
    mistakes_.expect(text::is_name(name), path,
                     fmt::format("'{}'; expected 1 to 32 letters, digits, '_' or '-'", name));
    mistakes_.expect(!is_there, path, fmt::format("'{}' occurs twice", name));
  }

  std::optional<Template> text_of(const std::string& text, const ConfigPath& path) {
    mistakes_.expect(base::text::is_utf8(text), path, "is not UTF-8");
    auto parsed = Template::parse(text);
    if (!mistakes_.expect(parsed.has_value(), path, parsed ? "" : parsed.error())) {
      return std::nullopt;
    }
    const std::set<std::string>& known = call_keys();
    for (const std::string& key : parsed->keys()) {
      mistakes_.expect(
          !key.starts_with(call_prefix) || known.contains(key), path,
          fmt::format("{{{}}} does not exist; known are {}", key, fmt::join(known, " ")));
      mistakes_.expect(key != "to", path, "requests name recipients with {to}; choose another key");
    }
    return *std::move(parsed);
  }

  void read_retry() {
    const config::Mail::Retry& from = from_.retry();
    const ConfigPath path{{"retry"}};
    mistakes_.expect(from.first_ms() > 0, path / "first_ms", "0; expected 1 or more");
    mistakes_.expect(
        from.longest_ms() >= from.first_ms(), path / "longest_ms",
        fmt::format("{}; expected first_ms ({}) or more", from.longest_ms(), from.first_ms()));
    mistakes_.expect(from.give_up_hours() > 0, path / "give_up_hours", "0; expected 1 or more");
    config_.retry = {.first = std::chrono::milliseconds(from.first_ms()),
                     .longest = std::chrono::milliseconds(from.longest_ms()),
                     .give_up = std::chrono::hours(from.give_up_hours())};
  }

  const config::Mail& from_;
  fs::path folder_;
  Mistakes& mistakes_;
  Config config_;
};

tl::expected<std::string, std::string> first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line)) {
    return tl::unexpected(base::posix::last_error("cannot read the password in " + file.string()));
  }
  if (line.ends_with('\r')) {
    line.pop_back();
  }
  return line;
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  config::Mail from;
  base::configuration::ConfigPlaces places;
  if (const auto read = base::configuration::read_config(file, from, places); !read) {
    return tl::unexpected(read.error());
  }
  Mistakes mistakes(from, places);
  Config config = Reader(from, fs::absolute(file).parent_path(), mistakes).read();
  if (!mistakes.none()) {
    return tl::unexpected(mistakes.text());
  }
  return config;
}

tl::expected<std::string, std::string> password(const ServerConfig& server) {
  if (server.user.empty()) {
    return std::string();
  }
  if (!server.password_file.empty()) {
    return first_line(server.password_file);
  }
  const char* const value = std::getenv(server.password_env.c_str());
  if (value == nullptr) {
    return tl::unexpected("the environment has no " + server.password_env +
                          ", which password_env names");
  }
  return std::string(value);
}

}  // namespace millrace::services::mail
