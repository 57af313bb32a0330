// Conversion between entries and the protobuf messages of idl/recording.proto.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// The serialised message of an entry.
std::string encode(const Entry& entry);

/// The inverse. `schema` is the full name of the message ("millrace.recording.Request"), `at` the
/// time of recording. The error is an unknown schema or a damaged message. An unknown enumerator
/// becomes 255, "unknown".
tl::expected<Entry, std::string> decode(std::string_view schema, std::string_view message,
                                        fabric::Time at);

/// Full name of the message an entry is written as.
std::string schema_name(const Entry& entry);

/// idl/recording.proto as a serialised google.protobuf.FileDescriptorSet, for readers without it.
const std::string& descriptor_set();

}  // namespace millrace::tools::recording
