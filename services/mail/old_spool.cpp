#include "services/mail/old_spool.hpp"

#include <fstream>
#include <sstream>
#include <system_error>

#include "base/configuration/config_file.hpp"
#include "base/posix/durable_file.hpp"
#include "base/text/number.hpp"
#include "idl/mail.pb.h"

namespace millrace::services::mail {

namespace {

namespace fs = std::filesystem;
using config::SpooledMail;

constexpr std::string_view name_end = ".mail";

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

fabric::Time time_in(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

tl::expected<Entry, std::string> read_entry(const fs::path& file, fabric::CallId call) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    return tl::unexpected(file.string() + ": cannot be read, or is empty");
  }
  auto entry = from_file(text.str(), file.string());
  if (entry && entry->call != call) {
    return tl::unexpected(file.string() + ": is of call " + entry->call.to_string());
  }
  return entry;
}

}  // namespace

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
              .made = time_in(record.made()),
              .attempts = record.attempts(),
              .next = time_in(record.next()),
              .reply = record.reply()};
  if (entry.stage == Stage::waiting && (entry.mail.from.empty() || entry.mail.to.empty())) {
    return tl::unexpected(name + ": it waits, but names no sender or recipient");
  }
  return entry;
}

std::optional<fabric::CallId> parse_call(std::string_view text) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos) {
    return std::nullopt;
  }
  const auto epoch = base::text::parse_number<std::uint64_t>(text.substr(0, dash), 16);
  const auto number = base::text::parse_number<std::uint64_t>(text.substr(dash + 1));
  if (!epoch || !number) {
    return std::nullopt;
  }
  return fabric::CallId{.epoch = *epoch, .number = *number};
}

std::optional<fabric::CallId> call_of(std::string_view file_name) {
  if (!file_name.ends_with(name_end)) {
    return std::nullopt;
  }
  file_name.remove_suffix(name_end.size());
  return parse_call(file_name);
}

OldSpool read_old_spool(const fs::path& folder) {
  OldSpool old;
  for (const auto& file : fs::directory_iterator(folder)) {
    const auto call = call_of(file.path().filename().string());
    if (!call) {
      continue;
    }
    auto entry = read_entry(file.path(), *call);
    if (entry) {
      old.files.push_back(file.path());
    } else {
      old.mistakes.push_back(entry.error());
      old.broken.push_back(file.path());
      entry = Entry{.call = *call, .stage = Stage::handed_over, .reply = "its file is broken"};
    }
    old.entries.push_back(*std::move(entry));
  }
  return old;
}

tl::expected<void, std::string> put_old_spool_away(const OldSpool& old) {
  for (const fs::path& file : old.broken) {
    if (auto renamed = base::posix::rename_durably(file, file.string() + ".broken"); !renamed) {
      return renamed;
    }
  }
  for (std::size_t i = 0; i < old.files.size(); ++i) {
    std::error_code failed;
    if (i + 1 == old.files.size()) {
      // Makes the removal of all files before it durable, too.
      return base::posix::remove_durably(old.files[i]);
    }
    if (fs::remove(old.files[i], failed); failed) {
      return tl::unexpected(old.files[i].string() + ": cannot be removed: " + failed.message());
    }
  }
  return {};
}

}  // namespace millrace::services::mail
