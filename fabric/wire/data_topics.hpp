// The topics of machine data in one place (idl/data.idl); QoS and partitions as of the others, see
// topics.hpp.
//
//   millrace/data      gateway to tools     partition FABRIC
//   millrace/program   gateway to tools     partition FABRIC
#pragma once

#include "fabric/wire/topics.hpp"

namespace millrace::fabric::wire {

extern const Topic data_topic;
extern const Topic program_topic;

}  // namespace millrace::fabric::wire
