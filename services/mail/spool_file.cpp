#include "services/mail/spool_file.hpp"

#include <google/protobuf/text_format.h>

#include "base/configuration/config_file.hpp"
#include "base/text/number.hpp"
#include "idl/mail.pb.h"

namespace millrace::services::mail {

namespace {

using config::SpooledMail;

constexpr std::string_view name_end = ".mail";

SpooledMail::Stage to_record(Stage stage) {
  switch (stage) {
    case Stage::waiting:
      return SpooledMail::WAITING;
    case Stage::handed_over:
      return SpooledMail::HANDED_OVER;
    case Stage::accepted:
      return SpooledMail::ACCEPTED;
    case Stage::refused:
      return SpooledMail::REFUSED;
    case Stage::given_up:
      return SpooledMail::GIVEN_UP;
  }
  return SpooledMail::WAITING;
}

Stage from_record(SpooledMail::Stage stage) {
  switch (stage) {
    case SpooledMail::WAITING:
      return Stage::waiting;
    case SpooledMail::HANDED_OVER:
      return Stage::handed_over;
    case SpooledMail::ACCEPTED:
      return Stage::accepted;
    case SpooledMail::REFUSED:
      return Stage::refused;
    case SpooledMail::GIVEN_UP:
      return Stage::given_up;
  }
  return Stage::handed_over;
}

fabric::Time time_of(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

}  // namespace

std::string to_file(const Entry& entry) {
  SpooledMail record;
  record.set_epoch(entry.call.epoch);
  record.set_number(entry.call.number);
  record.set_stage(to_record(entry.stage));
  record.set_made(entry.made.time_since_epoch().count());
  record.set_next(entry.next.time_since_epoch().count());
  record.set_attempts(entry.attempts);
  record.set_reply(entry.reply);
  record.set_from(entry.mail.from);
  for (const std::string& to : entry.mail.to) {
    record.add_to(to);
  }
  record.set_message(entry.mail.message);
  std::string text;
  google::protobuf::TextFormat::PrintToString(record, &text);
  return text;
}

tl::expected<Entry, std::string> from_file(const std::string& text, const std::string& name) {
  SpooledMail record;
  if (const auto parsed = base::configuration::parse_config(text, name, record); !parsed) {
    return tl::unexpected(parsed.error());
  }
  Entry entry{.call = {.epoch = record.epoch(), .number = record.number()},
              .stage = from_record(record.stage()),
              .mail = {.from = record.from(),
                       .to = {record.to().begin(), record.to().end()},
                       .message = record.message()},
              .made = time_of(record.made()),
              .attempts = record.attempts(),
              .next = time_of(record.next()),
              .reply = record.reply()};
  if (entry.stage == Stage::waiting && (entry.mail.from.empty() || entry.mail.to.empty())) {
    return tl::unexpected(name + ": it waits, but names no sender or recipient");
  }
  return entry;
}

std::string file_name(fabric::CallId call) {
  return call.to_string() + std::string(name_end);
}

std::optional<fabric::CallId> call_of(std::string_view file_name) {
  if (!file_name.ends_with(name_end)) {
    return std::nullopt;
  }
  file_name.remove_suffix(name_end.size());
  const std::size_t dash = file_name.find('-');
  if (dash == std::string_view::npos) {
    return std::nullopt;
  }
  const auto epoch = base::text::parse_number<std::uint64_t>(file_name.substr(0, dash), 16);
  const auto count = base::text::parse_number<std::uint64_t>(file_name.substr(dash + 1));
  if (!epoch || !count) {
    return std::nullopt;
  }
  return fabric::CallId{.epoch = *epoch, .number = *count};
}

}  // namespace millrace::services::mail
