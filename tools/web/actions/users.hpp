// Who may act, and with which password. The file names users and hashes; passwords are nowhere.
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
};

/// By name.
using Users = std::map<std::string, User>;

/// The error has a line for each mistake. A file that everybody on this host may read is one.
tl::expected<Users, std::string> read_users(const std::filesystem::path& file);

/// Whether the hash is one of `password`. Takes some tenths of a second, and that is what protects
/// it: for a thread beside the loop.
bool matches(const std::string& password, const std::string& hash);

/// A new hash of `password`, with a salt of its own. Throws std::runtime_error if the system has no
/// random numbers.
std::string hash_of(const std::string& password);

/// Of no password: comparing with it takes as long as comparing with one that a user has, so that
/// nobody learns from the time which users there are.
const std::string& hash_of_unknown_user();

}  // namespace millrace::tools::web::actions
