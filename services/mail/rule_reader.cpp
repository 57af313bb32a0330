#include "services/mail/rule_reader.hpp"

#include <optional>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "services/text/fields.hpp"

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
    case config::Mail::Rule::HELD:
      return ProgramEventKind::held;
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

}  // namespace

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

}  // namespace millrace::services::mail
