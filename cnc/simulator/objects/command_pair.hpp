// Commands with two objects: one to write, one to read the written value.
#pragma once

#include <utility>

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Adds `both` twice: with its name and _w as write-only, and with _r as read-only.
inline void add_pair(ObjectTable& table, std::uint32_t write_at, std::uint32_t read_at,
                     const Object& both) {
  Object command = both;
  command.name += "_w";
  command.read = {};
  Object answer = both;
  answer.name += "_r";
  answer.write = {};
  table.add(write_at, std::move(command));
  table.add(read_at, std::move(answer));
}

}  // namespace millrace::cnc::simulator::objects
