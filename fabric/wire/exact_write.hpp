// Writes a sample into a buffer of its size.
//
//   const dds_return_t result = write_exactly(writer, &sample, *topic.type);
#pragma once

#include <dds/dds.h>

namespace millrace::fabric::wire {

/// dds_write, but a writer that keeps the sample keeps its bytes: Cyclone 0.10 serialises into
/// buffers of 4 kB and does not shrink them (dds_ostream_grow), and a writer may keep sixteen of
/// each key. `sample` is a C struct of the writer's type. From any thread; returns Cyclone's code.
dds_return_t write_exactly(dds_entity_t writer, const void* sample,
                           const dds_topic_descriptor_t& type);

}  // namespace millrace::fabric::wire
