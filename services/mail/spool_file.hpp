// The form of a file of the spool. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "services/mail/mail.hpp"

namespace millrace::services::mail {

/// Protobuf text format (SpooledMail in idl/mail.proto).
std::string to_file(const Entry& entry);

/// `name` stands for the file in errors.
tl::expected<Entry, std::string> from_file(const std::string& text, const std::string& name);

/// "5f3a9c0112d4-17.mail"
std::string file_name(fabric::CallId call);

/// The call of a file by its name alone; nothing for files that are none of the spool.
std::optional<fabric::CallId> call_of(std::string_view file_name);

}  // namespace millrace::services::mail
