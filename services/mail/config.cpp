#include "services/mail/config.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include <fmt/format.h>

#include "base/configuration/check.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/posix/system.hpp"
#include "idl/mail.pb.h"
#include "services/mail/compose.hpp"

namespace millrace::services::mail {

namespace {

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

/// The kinds have the same names, in capitals.
fabric::plant::Kind kind_of_concern(config::Mail::Rule::Kind kind) {
  std::string name = config::Mail::Rule::Kind_Name(kind);
  std::ranges::transform(name, name.begin(), [](char c) {
    return c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  auto found = fabric::plant::Kind::missing;
  while (name_of(found) != name) {
    found = static_cast<fabric::plant::Kind>(static_cast<int>(found) + 1);
  }
  return found;
}

const char* default_subject(Rule::Kind kind) {
  return kind == Rule::Kind::program ? "{machine}/{channel}: program {program} {event}"
                                     : "{subject}: {what}";
}

const char* default_text(Rule::Kind kind) {
  return kind == Rule::Kind::program
             ? "Program {program} of {machine}, channel {channel}: {event} at {time} after "
               "{duration} "
               "s. Error: {error}. Parts: {parts}.\n{reason}\n"
             : "{subject}: {what} since {since}.\n{reason}\nTo do, by the {who}: {todo}\n";
}

namespace fs = std::filesystem;

/// Reads the valid fields and records the mistakes.
class Reader {
 public:
  Reader(const config::Mail& from, const fs::path& folder, Mistakes& mistakes)
      : from_(from), folder_(folder), mistakes_(mistakes) {}

  Config read() {
    read_server();
    config_.from = mistakes_.take(parse_address(from_.from()), {{"from"}});
    read_recipients();
    read_templates();
    for (int i = 0; i < from_.rule_size(); ++i) {
      config_.rules.push_back(rule(from_.rule(i), {{"rule", i}}));
    }
    read_retry();
    config_.spool = beside(from_.spool());
    return std::move(config_);
  }

 private:
  [[nodiscard]] fs::path beside(const std::string& name) const {
    return (folder_ / name).lexically_normal();
  }

  void read_server() {
    const config::Mail::Server& from = from_.server();
    const ConfigPath path{{"server"}};
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
                      .timeout = std::chrono::milliseconds(from.timeout_ms())};
  }

  void read_recipients() {
    for (int i = 0; i < from_.recipient_size(); ++i) {
      const config::Mail::Recipient& from = from_.recipient(i);
      auto& addresses = config_.recipients[from.name()];
      for (int j = 0; j < from.address_size(); ++j) {
        addresses.push_back(
            mistakes_.take(parse_address(from.address(j)), {{"recipient", i}, {"address", j}}));
      }
    }
  }

  void read_templates() {
    mistakes_.expect(from_.template__size() + from_.rule_size() > 0, {{"template"}},
                     "is missing; expected one or more, or a rule");
    for (int i = 0; i < from_.template__size(); ++i) {
      const config::Mail::Template& from = from_.template_(i);
      const ConfigPath path{{"template", i}};
      check_recipients(from.to(), path);
      config_.templates.insert_or_assign(
          from.name(),
          MailTemplate{.to = {from.to().begin(), from.to().end()},
                       .subject = text_of(from.subject(), path / "subject", call_keys(), true),
                       .text = text_of(from.text(), path / "text", call_keys(), true)});
    }
  }

  template <typename Names>
  void check_recipients(const Names& to, const ConfigPath& path) {
    for (int i = 0; i < to.size(); ++i) {
      mistakes_.expect(config_.recipients.contains(to[i]), path / ConfigStep{"to", i},
                       "'" + to[i] + "' is not a recipient");
    }
  }

  /// `known` are the keys that have a value; with `request`, further ones come with each request.
  Template text_of(const std::string& text, const ConfigPath& path,
                   const std::set<std::string>& known, bool request) {
    Template parsed = mistakes_.take(Template::parse(text), path);
    for (const std::string& key : parsed.keys()) {
      mistakes_.expect(
          (request && !key.starts_with(call_prefix)) || known.contains(key), path,
          fmt::format("{{{}}} does not exist; known are {}", key, fmt::join(known, " ")));
      mistakes_.expect(!request || key != "to", path,
                       "requests name recipients with {to}; choose another key");
    }
    return parsed;
  }

  Rule rule(const config::Mail::Rule& from, const ConfigPath& path) {
    const int given = (from.program_size() > 0 ? 1 : 0) + (from.has_concern() ? 1 : 0) +
                      (from.has_no_instance_of() ? 1 : 0);
    mistakes_.expect(given == 1, path, "a rule has one of program, concern and no_instance_of");
    const Rule::Kind kind = from.has_concern()          ? Rule::Kind::concern
                            : from.has_no_instance_of() ? Rule::Kind::no_instance
                                                        : Rule::Kind::program;
    mistakes_.expect(from.has_concern() || from.kind_size() == 0, path / "kind",
                     "needs concern: it selects what needs attention");
    mistakes_.expect(kind != Rule::Kind::no_instance || from.machine_size() == 0, path / "machine",
                     "a service has no machine");
    check_recipients(from.to(), path);
    Rule rule{.subject = text_of(from.subject().empty() ? default_subject(kind) : from.subject(),
                                 path / "subject", rule_keys(), false),
              .text = text_of(from.text().empty() ? default_text(kind) : from.text(), path / "text",
                              rule_keys(), false)};
    rule.name = from.name();
    rule.kind = kind;
    for (const int event : from.program()) {
      rule.events.insert(kind_of_event(event));
    }
    rule.least = from.concern() == config::Mail::Rule::LOOK ? fabric::plant::Level::look
                                                            : fabric::plant::Level::act;
    for (const int each : from.kind()) {
      rule.kinds.insert(kind_of_concern(static_cast<config::Mail::Rule::Kind>(each)));
    }
    rule.after = std::chrono::seconds(from.after_s());
    rule.uuid = fabric::canonical_uuid(from.no_instance_of());
    rule.machines = {from.machine().begin(), from.machine().end()};
    rule.to = {from.to().begin(), from.to().end()};
    rule.quiet = std::chrono::seconds(from.quiet_s());
    return rule;
  }

  void read_retry() {
    const config::Mail::Retry& from = from_.retry();
    mistakes_.expect(
        from.longest_ms() >= from.first_ms(), {{"retry"}, {"longest_ms"}},
        fmt::format("{}; expected first_ms ({}) or more", from.longest_ms(), from.first_ms()));
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
  return base::posix::read_first_line(file).map_error([&](const std::string& why) {
    return "cannot read the password in " + file.string() + ": " + why;
  });
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  return base::configuration::load<config::Mail>(
      file, [&](const config::Mail& from, Mistakes& mistakes) {
        return Reader(from, fs::absolute(file).parent_path(), mistakes).read();
      });
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
