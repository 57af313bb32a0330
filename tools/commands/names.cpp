#include "tools/commands/names.hpp"

#include <cctype>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"

namespace millrace::tools::commands {

Match match(const Names& names, const std::string& what) {
  // The beginning of a UUID is none, so it is not in lower case yet.
  std::string canonical = fabric::canonical_uuid(what);
  if (what.find_first_not_of("0123456789abcdefABCDEF-") == std::string::npos) {
    std::ranges::transform(canonical, canonical.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  Match best = Match::none;
  for (const std::string& name : names) {
    if (name == what || name == canonical) {
      return Match::exact;
    }
    if (name.starts_with(what) || name.starts_with(canonical)) {
      best = Match::begins;
    }
  }
  return best;
}

Names names_of(const fabric::plant::KnownInstance& instance) {
  return {instance.identity.uuid, instance.identity.id.to_string(), instance.identity.name};
}

std::vector<const fabric::plant::KnownInstance*> instances_named(const fabric::plant::Plant& live,
                                                                 const std::string& what) {
  return chosen(live.instances_of(""), what,
                [](const fabric::plant::KnownInstance* instance) { return names_of(*instance); });
}

int print_unknown(const std::string& kind, const std::string& what, Names known,
                  const fabric::dds::ParticipantOptions& fabric) {
  std::ranges::sort(known);
  const auto repeated = std::ranges::unique(known);
  known.erase(repeated.begin(), repeated.end());
  fmt::print(stderr, "millrace: no {} '{}' on fabric '{}', domain {}; {}\n", kind,
             base::text::safe(what), fabric.fabric, fabric.domain,
             known.empty()
                 ? std::string("none is known")
                 : "known: " + base::text::safe(fmt::format("{}", fmt::join(known, ", "))));
  return base::program::exit_failed;
}

int print_unknown_service(const std::string& what, const fabric::plant::Plant& live,
                          const fabric::dds::ParticipantOptions& fabric) {
  Names known;
  for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
    const fabric::InstanceIdentity& identity = instance->identity;
    known.push_back(fmt::format("{} ({})", identity.name, identity.uuid));
  }
  return print_unknown("service", what, std::move(known), fabric);
}

}  // namespace millrace::tools::commands
