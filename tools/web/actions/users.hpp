// Users, their permissions and their password hashes. Passwords are not stored.
//
//   const Users users = read_users("/etc/millrace/web.textproto");
//   if (const User* user = users.find("anna"); user && matches(password, user->password_hash)) …
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include <tl/expected.hpp>

#include "fabric/command.hpp"

namespace millrace::tools::web::actions {

struct User {
  std::string name{};
  std::string password_hash{};
  std::set<fabric::CommandKind> may{};
  /// Calls of services.
  bool may_call = false;
};

/// By name.
using Users = std::map<std::string, User>;

/// The error has a line for each mistake. A file that all users of the host may read is a mistake.
tl::expected<Users, std::string> read_users(const std::filesystem::path& file);

/// Whether the hash is one of `password`. Takes tenths of a second, which protects the password:
/// not for the loop's thread.
bool matches(const std::string& password, const std::string& hash);

/// A new hash of `password`, with a new salt. Throws std::runtime_error if the system has no random
/// numbers.
std::string hash_of(const std::string& password);

/// A hash that no password has. Comparing with it takes as long as with a user's, so that the time
/// does not reveal which users exist.
const std::string& hash_of_unknown_user();

}  // namespace millrace::tools::web::actions
