#include "fabric/trust/permissions.hpp"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/messages.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::fabric::trust {

namespace {

using wire::Topic;

/// Topics in the partition of the fabric itself, which every full observer reads.
const std::initializer_list<const Topic*> spoken{
    &wire::heartbeat_topic, &wire::channel_topic,         &wire::machine_topic, &wire::event_topic,
    &wire::command_topic,   &wire::outcome_topic,         &wire::alarm_topic,   &wire::data_topic,
    &wire::program_topic,   &wire::variable_request_topic};

class Grants {
 public:
  explicit Grants(std::string_view fabric) : fabric_(fabric), calls_(wire::all_services(fabric)) {}

  void of(Role role, const Participant& participant) {
    switch (role) {
      case Role::gateway:
        write({&wire::channel_topic, &wire::machine_topic, &wire::event_topic, &wire::outcome_topic,
               &wire::alarm_topic, &wire::data_topic, &wire::program_topic},
              fabric_);
        write({&wire::request_topic}, calls_);
        // To each requester of variables, in its own partition.
        write({&wire::variable_reply_topic}, calls_);
        see_everything();
        break;
      case Role::service:
        answer(participant);
        break;
      case Role::operating:
        // A requester that only reads variables also writes requests.
        write({&wire::command_topic, &wire::variable_request_topic}, fabric_);
        see_everything();
        break;
      case Role::observer:
        // The alarms of a recorder.
        write({&wire::alarm_topic}, fabric_);
        see_everything();
        break;
      case Role::tester:
        // What a replay publishes too: of machines that no gateway serves.
        write({&wire::event_topic, &wire::data_topic, &wire::program_topic}, fabric_);
        write({&wire::request_topic}, calls_);
        see_everything();
        break;
    }
  }

  /// Its own identity, readable for all, and those of the others.
  void add_identity(const Participant& participant) {
    ParticipantIdentity identity{.name = participant.name};
    for (const Role role : participant.roles) {
      identity.roles.emplace(name_of(role));
    }
    identity.machines.insert(participant.machines.begin(), participant.machines.end());
    for (const std::string& partition : identity_partitions(fabric_, identity)) {
      grants_.push_back({Access::write, identity_topic_name, partition});
    }
    grants_.push_back({Access::read, identity_topic_name, identity_readers_partition(fabric_)});
  }

  std::vector<Grant> take() {
    std::ranges::sort(grants_);
    const auto twice = std::ranges::unique(grants_);
    grants_.erase(twice.begin(), twice.end());
    return std::move(grants_);
  }

 private:
  void write(std::initializer_list<const Topic*> topics, const std::string& partition) {
    add(Access::write, topics, partition);
  }
  void read(std::initializer_list<const Topic*> topics, const std::string& partition) {
    add(Access::read, topics, partition);
  }
  void add(Access access, std::initializer_list<const Topic*> topics,
           const std::string& partition) {
    for (const Topic* topic : topics) {
      grants_.push_back({access, topic->name, partition});
    }
  }

  void see_everything() {
    read(spoken, fabric_);
    read({&wire::request_topic, &wire::reply_topic, &wire::variable_reply_topic}, calls_);
  }

  void answer(const Participant& participant) {
    // The writing participant decides whose heartbeat and outcome it is.
    write({&wire::heartbeat_topic, &wire::outcome_topic, &wire::alarm_topic}, fabric_);
    read({&wire::command_topic}, fabric_);
    for (const std::string& uuid : participant.uuids) {
      const std::string own = wire::service_partition(fabric_, canonical_uuid(uuid));
      write({&wire::reply_topic}, own);
      read({&wire::request_topic}, own + "/*");
    }
  }

  std::string fabric_;
  std::string calls_;
  std::vector<Grant> grants_;
};

}  // namespace

std::vector<Grant> grants_of(const Participant& participant, std::string_view fabric) {
  Grants grants(fabric);
  for (const Role role : participant.roles) {
    grants.of(role, participant);
  }
  grants.add_identity(participant);
  return grants.take();
}

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

std::string_view name_of(Protection protection) {
  return protection == Protection::sign ? "SIGN" : "ENCRYPT";
}

std::string governance_document(Protection protection) {
  // Whole messages are protected (RTPS), and discovery: the contents of a message need no further
  // protection.
  return fmt::format(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>{1}</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>{0}</discovery_protection_kind>
      <liveliness_protection_kind>{0}</liveliness_protection_kind>
      <rtps_protection_kind>{0}</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>NONE</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)",
      name_of(protection), last_domain);
}

bool is_governance(std::string_view document, Protection protection) {
  std::string text(document);
  std::erase(text, '\r');
  return text == governance_document(protection);
}

}  // namespace millrace::fabric::trust
