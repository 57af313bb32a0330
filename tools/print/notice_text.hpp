// What a program says of itself, for people and for programs.
//
//   said_by(notice) == "archiver on vm, pid 17"
//   what_is_said(notice) == "archiver on vm, pid 17: /srv/archive cannot be written: disk full"
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "fabric/notice.hpp"

namespace millrace::tools::print {

/// Safe to show.
std::string said_by(const fabric::Notice& notice);
std::string what_is_said(const fabric::Notice& notice);

/// As every `--json` has it: "level", "kind", "subject", "text", "advice", "since", "program",
/// "host", "pid", "responder".
boost::json::object json_of(const fabric::Notice& notice);

}  // namespace millrace::tools::print
