#include "tools/web/actions/users.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>

#include <crypt.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/configuration/check.hpp"
#include "base/text/ascii.hpp"
#include "idl/web.pb.h"

namespace millrace::tools::web::actions {

namespace {

using base::configuration::ConfigPath;
using base::configuration::Mistakes;

/// yescrypt, Debian's default for user passwords.
constexpr const char* method = "$y$";

bool is_user_name(const std::string& name) {
  return std::ranges::all_of(name, [](char c) {
    return base::text::is_alphanumeric(c) || c == '.' || c == '_' || c == '-';
  });
}

bool is_hash(const std::string& text) {
  return text.starts_with('$') && ::crypt_checksalt(text.c_str()) == CRYPT_SALT_OK;
}

std::optional<fabric::CommandKind> kind_of(config::Web::Action action) {
  switch (action) {
    case config::Web::CALL:
      return std::nullopt;
    case config::Web::ANSWER:
      return fabric::CommandKind::answer;
    case config::Web::RETRY:
      return fabric::CommandKind::retry;
    case config::Web::DRAIN:
      return fabric::CommandKind::drain;
  }
  return std::nullopt;
}

User user_of(const config::Web::User& configured) {
  User user{.name = configured.name(), .password_hash = configured.password_hash()};
  for (const int action : configured.may()) {
    if (const auto kind = kind_of(static_cast<config::Web::Action>(action))) {
      user.may.insert(*kind);
    } else {
      user.may_call = true;
    }
  }
  if (configured.may().empty()) {
    user.may_call = true;
    user.may = {fabric::CommandKind::answer, fabric::CommandKind::retry,
                fabric::CommandKind::drain};
  }
  return user;
}

Users users_of(const config::Web& web, const std::filesystem::path& file, Mistakes& mistakes) {
  struct stat status {};
  mistakes.expect(::stat(file.c_str(), &status) != 0 || (status.st_mode & S_IRWXO) == 0, {},
                  "every user of this host may read or change it, and it has password hashes; run "
                  "chmod o= on it");
  Users users;
  for (int i = 0; i < web.user_size(); ++i) {
    const ConfigPath path{{"user", i}};
    const config::Web::User& user = web.user(i);
    mistakes.expect(is_user_name(user.name()), path / "name",
                    fmt::format("\"{}\"; expected letters, digits, '.', '_' and '-'", user.name()));
    mistakes.expect(is_hash(user.password_hash()), path / "password_hash",
                    "no hash; expected one as `millrace web --hash-password` prints it");
    users.emplace(user.name(), user_of(user));
  }
  return users;
}

}  // namespace

tl::expected<Users, std::string> read_users(const std::filesystem::path& file) {
  return base::configuration::load<config::Web>(
      file,
      [&](const config::Web& web, Mistakes& mistakes) { return users_of(web, file, mistakes); });
}

bool matches(const std::string& password, const std::string& hash) {
  // 32 KiB: too much for a stack.
  const auto space = std::make_unique<crypt_data>();
  const char* const own = ::crypt_r(password.c_str(), hash.c_str(), space.get());
  // Comparing hashes needs no constant time.
  // crypt_r has read the password only up to its first NUL.
  return own != nullptr && own[0] != '*' && hash == own && password.find('\0') == std::string::npos;
}

std::string hash_of(const std::string& password) {
  std::string salt(CRYPT_GENSALT_OUTPUT_SIZE, '\0');
  const auto space = std::make_unique<crypt_data>();
  if (::crypt_gensalt_rn(method, 0, nullptr, 0, salt.data(), static_cast<int>(salt.size())) ==
      nullptr) {
    throw std::runtime_error("this system has no salt for a password: no random numbers");
  }
  const char* const hash = ::crypt_r(password.c_str(), salt.c_str(), space.get());
  if (hash == nullptr || hash[0] == '*') {
    throw std::runtime_error("this system's libcrypt cannot hash passwords by yescrypt");
  }
  return hash;
}

const std::string& hash_of_unknown_user() {
  static const std::string hash = hash_of("");
  return hash;
}

}  // namespace millrace::tools::web::actions
