// The log of Cyclone while a process runs: lines on standard error, in Cyclone's format. Repeated
// lines (a rejected participant tries once a second) appear at growing intervals.
#pragma once

#include <string>
#include <string_view>

namespace millrace::fabric::dds {

/// Installs this for the whole process.
void take_cyclone_log();

/// What lines of the same fault have in common: all words without digits. Words with digits are
/// ids, ports and times.
std::string kind_of_line(std::string_view text);

}  // namespace millrace::fabric::dds
