#include "fabric/trust/permissions.hpp"

#include <map>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/trust/governance.hpp"

namespace millrace::fabric::trust {

namespace {

std::string time_text(std::chrono::sys_seconds time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", time);
}

}  // namespace

std::string permissions_document(const std::vector<Grant>& grants, std::string_view subject,
                                 std::chrono::sys_seconds from, std::chrono::sys_seconds until) {
  // The topics of one partition go together: a rule is of all its topics in all its partitions.
  std::map<std::pair<Way, std::string>, std::string> topics;
  for (const Grant& grant : grants) {
    topics[{grant.way, grant.partition}] +=
        fmt::format("          <topic>{}</topic>\n", base::text::xml_text(grant.topic));
  }
  std::string rules;
  for (const auto& [where, of_it] : topics) {
    const std::string_view way = where.first == Way::write ? "publish" : "subscribe";
    rules += fmt::format(
        "      <{0}>\n        <topics>\n{1}        </topics>\n"
        "        <partitions><partition>{2}</partition></partitions>\n      </{0}>\n",
        way, of_it, base::text::xml_text(where.second));
  }
  return fmt::format(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
<permissions>
  <grant name="member">
    <subject_name>{}</subject_name>
    <validity><not_before>{}</not_before><not_after>{}</not_after></validity>
    <allow_rule>
      <domains><id_range><min>0</min><max>{}</max></id_range></domains>
{}    </allow_rule>
    <default>DENY</default>
  </grant>
</permissions>
</dds>
)",
      base::text::xml_text(subject), time_text(from), time_text(until), last_domain, rules);
}

}  // namespace millrace::fabric::trust
