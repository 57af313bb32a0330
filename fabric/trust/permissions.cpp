#include "fabric/trust/permissions.hpp"

#include <map>
#include <optional>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/trust/governance.hpp"

namespace millrace::fabric::trust {

namespace {

std::string time_text(std::chrono::sys_seconds time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", time);
}

/// The text between the two at or after `from`, which is moved behind it; nullopt if they are
/// missing.
std::optional<std::string_view> between(std::string_view text, std::string_view begin,
                                        std::string_view end, std::size_t& from) {
  const auto first = text.find(begin, from);
  const auto last = first == std::string_view::npos ? first : text.find(end, first);
  if (last == std::string_view::npos) {
    return std::nullopt;
  }
  from = last + end.size();
  return text.substr(first + begin.size(), last - first - begin.size());
}

/// The inverse of base::text::xml_text.
std::string plain_text(std::string_view xml) {
  std::string text(xml);
  for (const auto& [escaped, plain] : {std::pair<std::string_view, std::string_view>{"&lt;", "<"},
                                       {"&gt;", ">"},
                                       {"&quot;", "\""},
                                       {"&apos;", "'"},
                                       {"&amp;", "&"}}) {
    for (auto at = text.find(escaped); at != std::string::npos;
         at = text.find(escaped, at + plain.size())) {
      text.replace(at, escaped.size(), plain);
    }
  }
  return text;
}

}  // namespace

std::vector<std::string> identity_partitions_in(std::string_view document) {
  const std::string topic = fmt::format("<topic>{}</topic>", identity_topic_name);
  std::vector<std::string> all;
  std::size_t at = 0;
  while (const auto rule = between(document, "<publish>", "</publish>", at)) {
    std::size_t in_rule = 0;
    while (rule->find(topic) != std::string_view::npos) {
      const auto partition = between(*rule, "<partition>", "</partition>", in_rule);
      if (!partition) {
        break;
      }
      all.push_back(plain_text(*partition));
    }
  }
  return all;
}

std::optional<std::string> mismatch_in(std::string_view document, std::string_view subject,
                                       std::chrono::sys_seconds from,
                                       std::chrono::sys_seconds until) {
  const auto field = [document](std::string_view name) {
    std::size_t at = 0;
    return plain_text(
        between(document, fmt::format("<{}>", name), fmt::format("</{}>", name), at).value_or(""));
  };
  if (const std::string about = field("subject_name"); about != subject) {
    return fmt::format("is made for {}, and the certificate for {}", base::text::safe(about),
                       base::text::safe(subject));
  }
  const std::string begin = field("not_before");
  const std::string end = field("not_after");
  if (begin != time_text(from) || end != time_text(until)) {
    return fmt::format("is valid from {} to {}, and the certificate from {} to {}",
                       base::text::safe(begin), base::text::safe(end), time_text(from),
                       time_text(until));
  }
  return std::nullopt;
}

std::string permissions_document(const std::vector<Grant>& grants, std::string_view subject,
                                 std::chrono::sys_seconds from, std::chrono::sys_seconds until) {
  // A rule allows an endpoint whose partitions are all in it: those of a topic go together, and
  // topics that have the same ones.
  std::map<std::pair<Access, std::string>, std::string> partitions;
  for (const Grant& grant : grants) {
    partitions[{grant.access, grant.topic}] +=
        fmt::format("          <partition>{}</partition>\n", base::text::xml_text(grant.partition));
  }
  std::map<std::pair<Access, std::string>, std::string> topics;
  for (const auto& [what, where] : partitions) {
    topics[{what.first, where}] +=
        fmt::format("          <topic>{}</topic>\n", base::text::xml_text(what.second));
  }
  std::string rules;
  for (const auto& [where, of_it] : topics) {
    const std::string_view way = where.first == Access::write ? "publish" : "subscribe";
    rules += fmt::format(
        "      <{0}>\n        <topics>\n{1}        </topics>\n"
        "        <partitions>\n{2}        </partitions>\n      </{0}>\n",
        way, of_it, where.second);
  }
  return fmt::format(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
<permissions>
  <grant name="participant">
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
