// Conversion between entries and the protobuf messages of idl/recording.proto.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "tools/mcap/records.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// The serialised message of an entry.
std::string encode(const Entry& entry);

/// The inverse. `schema` is the full name of the message ("millrace.recording.Request"), `at` the
/// time of recording. The error is an unknown schema or a damaged message. A code of a later
/// version keeps its number.
tl::expected<Entry, std::string> decode(std::string_view schema, std::string_view message,
                                        fabric::Time at);

/// Full name of the message an entry is written as.
std::string schema_name(const Entry& entry);

/// idl/recording.proto as a serialised google.protobuf.FileDescriptorSet, for readers without it.
const std::string& descriptor_set();

// The MCAP channel of an entry, named by what happened, not by DDS topic:
//
//   machine/cnc/1/request    machine/cnc/1/reply    machine/cnc/1/event
//   service/560aacbf-…/instance    operator/command    program/millrace-archiver/alarm

/// The MCAP topic of an entry.
std::string topic_of(const Entry& entry);

/// The origin of an entry: DDS topic, type and QoS, for the metadata of its MCAP channel.
mcap::StringMap origin_metadata(const Entry& entry);

}  // namespace millrace::tools::recording
