#include "fabric/trust/governance.hpp"

#include <fmt/format.h>

namespace millrace::fabric::trust {

std::string_view name_of(Protection protection) {
  return protection == Protection::sign ? "SIGN" : "ENCRYPT";
}

std::optional<Protection> protection_named(std::string_view name) {
  if (name == name_of(Protection::sign)) {
    return Protection::sign;
  }
  return name == name_of(Protection::encrypt) ? std::optional(Protection::encrypt) : std::nullopt;
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
