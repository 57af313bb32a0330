// Machine data, program events and alarms for people and programs.
//
//   text_of(value)          == "3.5", "TRUE", "\"text\"", "[1, 2, 3]"
//   json_of(value)          == {"name":"V.E.LIMIT","type":"REAL64","quality":"good","value":3.5, …}
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "fabric/alarm.hpp"
#include "fabric/data.hpp"

namespace millrace::tools::print {

/// The elements of a value; an array in brackets, "-" for a value that was never read.
std::string text_of(const fabric::Value& value);
/// A number, a truth value or a text; an array of them; null for a value that was never read.
boost::json::value json_of_elements(const fabric::Value& value);
boost::json::object json_of(const fabric::Value& value);

/// The fields of an event, with the word for its mode and "duration_s".
void put_program(boost::json::object& out, const fabric::ProgramEvent& event);

/// "standby", "automatic", …; the number of a mode that has no name.
std::string mode_text(std::uint32_t mode);
/// One line of an event without time and channel: "aborted  "demo.nc"  error 21462, after 12.3 s".
std::string line_of(const fabric::ProgramEvent& event);
/// Every value of a sample with its name, and its reason if it is not good.
std::string line_of(const fabric::DataSample& sample);

// Alarms as text and as JSON.
//
//   reported_by(alarm) == "archiver on vm, pid 17"
//   reported_problems(alarm) == "archiver on vm, pid 17: /srv/archive cannot be written: disk full"

/// Safe to show.
std::string reported_by(const fabric::Alarm& alarm);
std::string reported_problems(const fabric::Alarm& alarm);

/// The JSON of every `--json`: "level", "kind", "subject", "text", "advice", "since", "program",
/// "host", "pid", "responder".
boost::json::object json_of(const fabric::Alarm& alarm);

}  // namespace millrace::tools::print
