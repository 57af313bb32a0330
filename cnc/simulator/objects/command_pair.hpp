// Commands that have two objects: one to write, one to read what was written.
#pragma once

#include <utility>

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Adds `both` twice: with its name and _w, which can only be written, and with _r, which can only
/// be read.
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
