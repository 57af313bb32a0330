// Names on the command line: a UUID, an id, a name, or the beginning of one.
//
//   const auto rows = chosen(all, "560aac", [](const Row& row) { return Names{row.uuid}; });
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::tools::commands {

using Names = std::vector<std::string>;

/// `exact`: also in upper and lower case.
enum class Match : std::uint8_t { none, begins, any_case, exact };
/// UUIDs and names are compared without regard to the case of ASCII letters.
Match match(const Names& names, const std::string& what);

/// The rows with the name `what`, or else those with a name that begins with it; all for "".
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
Names names_of(const fabric::plant::KnownInstance& instance);
/// The instances with this UUID, id or name, or the beginning of one.
std::vector<const fabric::plant::KnownInstance*> instances_named(const fabric::plant::Plant& live,
                                                                 const std::string& what);

/// Prints that `what` does not exist, and the names that do. `kind`: "machine", "service". Returns
/// the exit code.
int print_unknown(const std::string& kind, const std::string& what, Names known,
                  const fabric::dds::ParticipantOptions& fabric);
/// The same for a service, with the services on the fabric.
int print_unknown_service(const std::string& what, const fabric::plant::Plant& live,
                          const fabric::dds::ParticipantOptions& fabric);

}  // namespace millrace::tools::commands
