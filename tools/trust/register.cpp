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
    return tl::unexpected(
        fmt::format("{} is not a PKI folder: it has no {}; `millrace trust init` makes one",
                    folder.string(), register_name));
  }
  auto participants = std::make_unique<config::TrustRegister>();
  if (auto read = base::configuration::read_config(file, *participants); !read) {
    return tl::unexpected(read.error());
  }
  return participants;
}

tl::expected<void, std::string> write_register(const fs::path& folder,
                                               const config::TrustRegister& participants) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(participants, &text);
  return base::posix::write_durably(
      folder / register_name,
      "# Written by `millrace trust`: the certificates that the CAs of this PKI have issued.\n" +
          text);
}

void describe(config::TrustParticipant& record, const fabric::trust::Participant& participant,
              const IssueOptions& options) {
  record.set_name(participant.name);
  record.clear_role();
  for (const fabric::trust::Role role : participant.roles) {
    record.add_role(std::string(fabric::trust::name_of(role)));
  }
  record.mutable_uuid()->Assign(participant.uuids.begin(), participant.uuids.end());
  record.mutable_machine()->Assign(participant.machines.begin(), participant.machines.end());
  if (!options.host.empty()) {
    record.set_host(options.host);
  }
  if (options.foreign) {
    record.set_foreign(true);
  }
}

Entry entry_of(const config::TrustParticipant& record) {
  Entry entry;
  entry.participant.name = record.name();
  entry.host = record.host();
  entry.revoked = is_revoked(record);
  entry.foreign = record.foreign();
  for (const std::string& role : record.role()) {
    if (const auto known = fabric::trust::role_named(role)) {
      entry.participant.roles.insert(*known);
    }
  }
  entry.participant.uuids.assign(record.uuid().begin(), record.uuid().end());
  entry.participant.machines.assign(record.machine().begin(), record.machine().end());
  if (record.issue_size() > 0) {
    const config::Issue& last = record.issue(record.issue_size() - 1);
    entry.serial = last.serial();
    entry.from = time_of(last.from());
    entry.until = time_of(last.until());
  }
  return entry;
}

bool is_revoked(const config::TrustParticipant& record) {
  return record.issue_size() > 0 &&
         std::ranges::all_of(record.issue(),
                             [](const config::Issue& issue) { return issue.revoked() != 0; });
}

std::vector<base::openssl::Revoked> revoked_in(const config::TrustRegister& participants) {
  std::vector<base::openssl::Revoked> all;
  for (const config::TrustParticipant& participant : participants.participant()) {
    for (const config::Issue& issue : participant.issue()) {
      if (issue.revoked() != 0) {
        all.push_back({issue.serial(), time_of(issue.revoked()), participant.name()});
      }
    }
  }
  return all;
}

}  // namespace millrace::tools::trust
