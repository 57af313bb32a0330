// Alarms as text and as JSON.
//
//   said_by(alarm) == "archiver on vm, pid 17"
//   what_is_said(alarm) == "archiver on vm, pid 17: /srv/archive cannot be written: disk full"
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "fabric/alarm.hpp"

namespace millrace::tools::print {

/// Safe to show.
std::string said_by(const fabric::Alarm& alarm);
std::string what_is_said(const fabric::Alarm& alarm);

/// The JSON of every `--json`: "level", "kind", "subject", "text", "advice", "since", "program",
/// "host", "pid", "responder".
boost::json::object json_of(const fabric::Alarm& alarm);

}  // namespace millrace::tools::print
