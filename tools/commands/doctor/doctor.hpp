// `millrace doctor`: finds problems of a fabric, and what to do about them.
#pragma once

#include "fabric/profile/command_line.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::commands::doctor {

void add_doctor(CLI::App& app, Chosen& chosen);

// How a command joins its fabric, as input of an examination.

/// From the flags and the file they name. Throws program::UsageError with every mistake of it.
tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join);

}  // namespace millrace::tools::commands::doctor
