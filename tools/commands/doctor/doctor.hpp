// `millrace doctor`: finds problems of a fabric, and what to do about them.
#pragma once

#include "fabric/profile/command_line.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/doctor/diagnose.hpp"

namespace millrace::tools::commands::doctor {

void add_doctor(CLI::App& app, Chosen& chosen);

/// For a terminal of `width` characters; 0 = unlimited. Faults first; what is fine only with `all`.
std::string text_of(const tools::doctor::Findings& found,
                    const std::vector<tools::doctor::Diagnosis>& diagnoses, std::size_t width,
                    bool all);

// How a command joins its fabric, as input of an examination.

/// From the flags and the file they name. Throws program::UsageError with every mistake of it.
tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join);

}  // namespace millrace::tools::commands::doctor
