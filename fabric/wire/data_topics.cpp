#include "fabric/wire/data_topics.hpp"

#include "idl/data.h"

namespace millrace::fabric::wire {

namespace {

/// Of one group: what a recorder may be behind. At 100 beats a second that is a third of one.
constexpr std::int32_t beats_in_flight = 32;

/// Of one channel: programs come one after the other, and short ones many in a second.
constexpr std::int32_t program_events_in_flight = 128;

}  // namespace

const Topic data_topic{
    "millrace/data", &millrace_DataSample_desc, true, beats_in_flight, false, 4'096};
const Topic program_topic{
    "millrace/program", &millrace_ProgramEvent_desc, true, program_events_in_flight, false, 4'096};

}  // namespace millrace::fabric::wire
