// The commands of `millrace trust` that write a PKI folder.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::trust {

void add_init(CLI::App& trust, Chosen& chosen);
void add_issue(CLI::App& trust, Chosen& chosen);
void add_renew(CLI::App& trust, Chosen& chosen);
void add_renew_authorities(CLI::App& trust, Chosen& chosen);
void add_revoke(CLI::App& trust, Chosen& chosen);

}  // namespace millrace::tools::commands::trust
