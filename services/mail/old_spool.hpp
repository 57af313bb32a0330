// The spool of earlier versions: a file for each call, "5f3a9c0112d4-17.mail". A spool imports
// these files when it is opened, and removes them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/mail.hpp"

namespace millrace::services::mail {

/// The call of "5f3a9c0112d4-17", as CallId::to_string writes it.
std::optional<fabric::CallId> parse_call(std::string_view text);

/// The call of a file by its name; nullopt for files that are not of the spool.
std::optional<fabric::CallId> call_of(std::string_view file_name);

/// Parses the content of a file, protobuf text format (SpooledMail in idl/mail.proto). `name` is
/// the file's name in errors.
tl::expected<Entry, std::string> from_file(const std::string& text, const std::string& name);

struct OldSpool {
  std::vector<Entry> entries;
  /// One line for each file that cannot be read; its call is among the entries as handed over.
  std::vector<std::string> mistakes;
  std::vector<std::filesystem::path> files;
  std::vector<std::filesystem::path> broken;

  [[nodiscard]] bool empty() const { return entries.empty(); }
};

/// Reads all files of an old spool in `folder`.
OldSpool read_old_spool(const std::filesystem::path& folder);

/// Removes its files durably, and appends ".broken" to the names of those that cannot be read.
tl::expected<void, std::string> put_old_spool_away(const OldSpool& old);

}  // namespace millrace::services::mail
