#include "tools/trust/register.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "base/configuration/config_file.hpp"
#include "base/posix/durable_file.hpp"
#include "idl/trust.pb.h"

namespace millrace::tools::trust {

namespace {

namespace fs = std::filesystem;

Time time_of(std::int64_t seconds) {
  return Time(std::chrono::seconds(seconds));
}

}  // namespace

tl::expected<std::unique_ptr<config::TrustRegister>, std::string> read_register(
    const fs::path& folder) {
  const fs::path file = folder / register_name;
  std::error_code none;
  if (!fs::exists(file, none)) {
    return tl::unexpected(fmt::format(
        "{} is no folder of a plant's trust: it has no {}; `millrace trust init` makes one",
        folder.string(), register_name));
  }
  auto members = std::make_unique<config::TrustRegister>();
  if (auto read = base::configuration::read_config(file, *members); !read) {
    return tl::unexpected(read.error());
  }
  return members;
}

tl::expected<void, std::string> write_register(const fs::path& folder,
                                               const config::TrustRegister& members) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(members, &text);
  return base::posix::write_durably(
      folder / register_name,
      "# Written by `millrace trust`; whom the authorities of this plant have believed what.\n" +
          text);
}

void describe(config::TrustMember& record, const fabric::trust::Member& member,
              const IssueOptions& options) {
  record.set_name(member.name);
  record.clear_role();
  for (const fabric::trust::Role role : member.roles) {
    record.add_role(std::string(fabric::trust::name_of(role)));
  }
  record.mutable_uuid()->Assign(member.uuids.begin(), member.uuids.end());
  record.mutable_machine()->Assign(member.machines.begin(), member.machines.end());
  if (!options.host.empty()) {
    record.set_host(options.host);
  }
  if (options.foreign) {
    record.set_foreign(true);
  }
}

Entry entry_of(const config::TrustMember& record) {
  Entry entry;
  entry.member.name = record.name();
  entry.host = record.host();
  entry.revoked = is_revoked(record);
  entry.foreign = record.foreign();
  for (const std::string& role : record.role()) {
    if (const auto known = fabric::trust::role_named(role)) {
      entry.member.roles.insert(*known);
    }
  }
  entry.member.uuids.assign(record.uuid().begin(), record.uuid().end());
  entry.member.machines.assign(record.machine().begin(), record.machine().end());
  if (record.issue_size() > 0) {
    const config::Issue& last = record.issue(record.issue_size() - 1);
    entry.serial = last.serial();
    entry.from = time_of(last.from());
    entry.until = time_of(last.until());
  }
  return entry;
}

bool is_revoked(const config::TrustMember& record) {
  return record.issue_size() > 0 &&
         std::ranges::all_of(record.issue(),
                             [](const config::Issue& issue) { return issue.revoked() != 0; });
}

std::vector<base::openssl::Revoked> revoked_in(const config::TrustRegister& members) {
  std::vector<base::openssl::Revoked> all;
  for (const config::TrustMember& member : members.member()) {
    for (const config::Issue& issue : member.issue()) {
      if (issue.revoked() != 0) {
        all.push_back({issue.serial(), time_of(issue.revoked()), member.name()});
      }
    }
  }
  return all;
}

}  // namespace millrace::tools::trust
