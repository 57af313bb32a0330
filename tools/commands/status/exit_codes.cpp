#include "tools/commands/status/exit_codes.hpp"

#include <algorithm>

#include "base/program/command_line.hpp"

namespace millrace::tools::commands::status {

using fabric::plant::Concern;
using fabric::plant::Kind;

int exit_code_of(const Concern& concern) {
  if (concern.level != fabric::plant::Level::act) {
    return base::program::exit_done;
  }
  switch (concern.kind) {
    case Kind::missing:
      return base::program::exit_failed;
    case Kind::no_gateway:
    case Kind::gateway_gone:
    case Kind::link_down:
      return exit_link_down;
    case Kind::held:
      return exit_held;
    case Kind::unserved:
    case Kind::waiting:
      return exit_unserved;
    case Kind::program_aborted:
      return exit_program_aborted;
    default:
      return exit_alarm;
  }
}

int exit_code_of(const Concerns& concerns) {
  int code = base::program::exit_done;
  for (const Concern& concern : concerns) {
    const int each = exit_code_of(concern);
    code = code == base::program::exit_done   ? each
           : each == base::program::exit_done ? code
                                              : std::min(code, each);
  }
  return code;
}

}  // namespace millrace::tools::commands::status
