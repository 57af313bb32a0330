// The MCAP channel of an entry, named by what happened, not by DDS topic:
//
//   machine/cnc/1/request    machine/cnc/1/reply    machine/cnc/1/event
//   service/560aacbf-…/instance    operator/command    program/millrace-archiver/alarm
#pragma once

#include <string>

#include "tools/mcap/records.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// The MCAP topic of an entry.
std::string topic_of(const Entry& entry);

/// The origin of an entry: DDS topic, type and QoS, for the metadata of its MCAP channel.
mcap::StringMap origin_metadata(const Entry& entry);

}  // namespace millrace::tools::recording
