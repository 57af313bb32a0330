// What a user names on the command line: a UUID, an id, a name, or the beginning of one.
//
//   const auto rows = chosen(all, "560aac", [](const Row& row) { return Names{row.uuid}; });
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::commands {

using Names = std::vector<std::string>;

enum class Match : std::uint8_t { none, begins, exact };
/// UUIDs are compared without regard to case.
Match match(const Names& names, const std::string& what);

/// The rows of which `what` is a name, or else the beginning of one; all for "".
template <typename Row, typename NamesOf>
std::vector<Row> chosen(std::vector<Row> rows, const std::string& what, NamesOf names_of) {
  if (what.empty()) {
    return rows;
  }
  Match best = Match::begins;
  for (const Row& row : rows) {
    best = std::max(best, match(names_of(row), what));
  }
  std::erase_if(rows, [&](const Row& row) { return match(names_of(row), what) < best; });
  return rows;
}

/// UUID, id and name.
Names names_of(const bus::KnownInstance& instance);
/// The instances that `what` names.
std::vector<const bus::KnownInstance*> instances_named(const bus::FabricModel& live,
                                                       const std::string& what);

/// Says that there is no such one and which there are: `kind` is "machine", "service". The exit
/// code.
int say_unknown(const std::string& kind, const std::string& what, Names known,
                const fabric::dds::ParticipantOptions& fabric);
/// The same for a service; known are those on the fabric.
int say_unknown_service(const std::string& what, const bus::FabricModel& live,
                        const fabric::dds::ParticipantOptions& fabric);

}  // namespace millrace::tools::commands
