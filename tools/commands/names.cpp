#include "tools/commands/names.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"

namespace millrace::tools::commands {

namespace {

Match match_of(const std::string& name, const std::string& what) {
  using base::text::small_letters;
  const std::string small = small_letters(name);
  return name == what                             ? Match::exact
         : small == fabric::canonical_uuid(what)  ? Match::exact
         : small == small_letters(what)           ? Match::any_case
         : small.starts_with(small_letters(what)) ? Match::begins
                                                  : Match::none;
}

}  // namespace

Match match(const Names& names, const std::string& what) {
  Match best = Match::none;
  for (const std::string& name : names) {
    best = std::max(best, match_of(name, what));
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
