#include "tools/commands/web/hash_password.hpp"

#include <string>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "tools/commands/hidden_input.hpp"
#include "tools/web/actions/users.hpp"

namespace millrace::tools::commands::web {

int print_hash() {
  const std::string password = read_hidden("Password");
  if (password.empty()) {
    throw base::program::UsageError("--hash-password: expected a password on standard input");
  }
  fmt::print("{}\n", tools::web::actions::hash_of(password));
  return base::program::exit_done;
}

}  // namespace millrace::tools::commands::web
