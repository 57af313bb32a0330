#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using base::text::safe;

using recording::Entry;

std::string text_or_size(const std::string& text, const Entry& entry) {
  return entry.withheld ? fmt::format("({} bytes, not recorded)", *entry.withheld)
                        : base::text::quoted(text);
}

std::string detail_of(const std::string& detail) {
  return detail.empty() ? "" : "  " + safe(detail);
}

/// The part of a line after time, kind, channel and call.
class Tail {
 public:
  explicit Tail(const Entry& entry) : entry_(entry) {}

  std::string operator()(const fabric::Request& request) const {
    return fmt::format("#{} to {}  {} {}  state {}", request.attempt, request.assigned.to_string(),
                       safe(request.uuid), text_or_size(request.text, entry_), request.state) +
           replayed(request.replayed);
  }
  std::string operator()(const fabric::Reply& reply) const {
    return fmt::format("#{} {} {}  {}  state {}  by {}", reply.attempt, name_of(reply.kind),
                       name_of(reply.code), text_or_size(reply.text, entry_), reply.state,
                       reply.instance.to_string()) +
           replayed(reply.replayed);
  }
  std::string operator()(const recording::Withdrawal& withdrawal) const {
    return by("from", withdrawal.instance);
  }
  std::string operator()(const fabric::ChannelStatus& status) const {
    return std::string(name_of(status.state)) + detail_of(status.reason);
  }
  std::string operator()(const recording::InstanceNews& news) const {
    return fmt::format(
        "{}  {} {} on {} ({}){}", name_of(news.change), entry_.uuid, safe(news.identity.name),
        safe(news.identity.host), news.identity.id.to_string(),
        news.identity.certificate.empty() ? "" : " as " + safe(news.identity.certificate));
  }
  std::string operator()(const fabric::InstanceStatus& status) const {
    return fmt::format("{}  {} running, {} answered, {} failed, mean {}",
                       status.instance.to_string(), status.running, status.answered, status.failed,
                       duration_text(status.mean));
  }
  std::string operator()(const fabric::Event& event) const {
    const bool has_text = entry_.withheld || !event.text.empty();
    return fmt::format("{}{}{}{}{}{}", event.attempt != 0 ? fmt::format("#{} ", event.attempt) : "",
                       name_of(event.kind), has_text ? "  " + text_or_size(event.text, entry_) : "",
                       event.state != 0 ? fmt::format("  state {}", event.state) : "",
                       detail_of(event.detail), by("  instance", event.instance)) +
           replayed(event.replayed);
  }
  std::string operator()(const fabric::Command& command) const {
    const bool has_text = command.kind == fabric::CommandKind::answer;
    return fmt::format(
        "{} by {}{}{}  command {}", name_of(command.kind), safe(command.issuer),
        has_text ? fmt::format("  {}  state {}", text_or_size(command.text, entry_), command.state)
                 : "",
        by("  to", command.instance), command.id.to_string());
  }
  std::string operator()(const fabric::MachineStatus& status) const {
    return fmt::format("{}  {} at {}", safe(status.machine),
                       status.connected ? "connected" : "not connected", safe(status.address)) +
           detail_of(status.reason);
  }
  std::string operator()(const fabric::DataSample& sample) const { return print::line_of(sample); }
  std::string operator()(const fabric::ProgramEvent& event) const { return print::line_of(event); }
  std::string operator()(const recording::AlarmNews& news) const {
    const fabric::Alarm& alarm = news.alarm;
    return fmt::format("{}  {}{}{}", news.over ? "over" : name_of(alarm.level),
                       safe(alarm.key.kind),
                       alarm.key.subject.empty() ? "" : " " + safe(alarm.key.subject),
                       alarm.program.empty() ? "" : "  " + reported_problems(alarm));
  }
  std::string operator()(const fabric::Outcome& outcome) const {
    return fmt::format("{}{}  by {}  command {}", outcome.done ? "done" : "refused",
                       detail_of(outcome.detail), outcome.responder.to_string(),
                       outcome.command.to_string());
  }

 private:
  /// Nothing if no instance is known.
  static std::string by(std::string_view what, const fabric::InstanceId& instance) {
    return instance == fabric::InstanceId{} ? "" : fmt::format("{} {}", what, instance.to_string());
  }
  static std::string replayed(bool replayed) { return replayed ? "  (replayed)" : ""; }

  const Entry& entry_;
};

}  // namespace

std::string line_of(const Entry& entry) {
  std::string line = fmt::format("{}  {:<10}", time_text(entry.at), kind_of(entry));
  if (const fabric::ChannelKey* key = channel_of(entry); key != nullptr && !key->machine.empty()) {
    line += fmt::format("  {}", safe(key->to_string()));
  }
  if (const fabric::CallId call = call_of(entry); call != fabric::CallId{}) {
    line += fmt::format("  {}", call.to_string());
  }
  const std::string tail = std::visit(Tail(entry), entry.sample);
  return tail.empty() ? line : line + "  " + tail;
}

}  // namespace millrace::tools::print
