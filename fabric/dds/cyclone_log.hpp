// What Cyclone has to say while a program runs: a line on standard error, as Cyclone itself writes
// it. One that comes again and again (who is not believed asks once a second) is said at intervals
// that grow.
#pragma once

#include <string>
#include <string_view>

namespace millrace::fabric::dds {

/// Has it do so from now on, for the whole process.
void take_cyclone_log();

/// What lines of the same fault have in common: all of it but the words with a digit in them, which
/// are ids, ports and times.
std::string kind_of_line(std::string_view text);

}  // namespace millrace::fabric::dds
