#include "tools/trust/plant.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>
#include <sys/stat.h>

#include "base/configuration/config_file.hpp"
#include "base/posix/durable_file.hpp"
#include "base/posix/folder_lock.hpp"
#include "fabric/trust/folder.hpp"
#include "idl/trust.pb.h"
#include "tools/trust/member_folder.hpp"

namespace millrace::tools::trust {

namespace {

namespace fs = std::filesystem;
using fabric::trust::Member;

template <typename T>
using Result = tl::expected<T, std::string>;

constexpr const char* register_name = "register.textproto";
constexpr const char* authorities_name = "authorities";
constexpr const char* lock_name = ".lock";
constexpr int most_days = 36'500;

Time time_of(std::int64_t seconds) {
  return Time(std::chrono::seconds(seconds));
}

std::int64_t seconds_of(Time time) {
  return time.time_since_epoch().count();
}

bool all_revoked(const config::TrustMember& record) {
  return std::ranges::all_of(record.issue(),
                             [](const config::Issue& issue) { return issue.revoked() != 0; });
}

Entry entry_of(const config::TrustMember& record) {
  Entry entry;
  entry.member.name = record.name();
  entry.host = record.host();
  entry.revoked = all_revoked(record);
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

Result<void> check_days(int days) {
  if (days < 1 || days > most_days) {
    return tl::unexpected(fmt::format("{} days; expected 1 to {}", days, most_days));
  }
  return {};
}

/// A folder that is not there yet, or is empty.
Result<void> make_empty_folder(const fs::path& folder) {
  std::error_code failed;
  if (fs::exists(folder, failed)) {
    if (fs::is_directory(folder, failed) && fs::is_empty(folder, failed)) {
      ::chmod(folder.c_str(), owner_folder);
      return {};
    }
    return tl::unexpected(fmt::format(
        "{} is there already; the authorities of a plant are never overwritten", folder.string()));
  }
  fs::create_directories(folder, failed);
  if (failed || ::chmod(folder.c_str(), owner_folder) != 0) {
    return tl::unexpected(
        fmt::format("{}: cannot be created ({})", folder.string(), failed.message()));
  }
  return {};
}

Result<void> write_register(const fs::path& folder, const config::TrustRegister& members) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(members, &text);
  return base::posix::write_durably(
      folder / register_name,
      "# Written by `millrace trust`; whom the authorities of this plant have believed what.\n" +
          text);
}

}  // namespace

Plant::Plant(fs::path folder, base::posix::Fd lock, std::unique_ptr<config::TrustRegister> members)
    : folder_(std::move(folder)), lock_(std::move(lock)), register_(std::move(members)) {}
Plant::Plant(Plant&&) noexcept = default;
Plant& Plant::operator=(Plant&&) noexcept = default;
Plant::~Plant() = default;

Result<void> Plant::create(const fs::path& folder, std::string_view name, std::string_view fabric,
                           int days, std::string_view passphrase, Time now) {
  if (auto checked = check_days(days); !checked) {
    return checked;
  }
  if (auto made = make_empty_folder(folder); !made) {
    return made;
  }
  config::TrustRegister members;
  members.set_plant(std::string(name));
  members.set_fabric(std::string(fabric));
  // The register comes last: a folder without one is not taken for a plant.
  return Authorities::create(name, now, now + std::chrono::days(days))
      .write(folder / authorities_name, passphrase)
      .and_then([&] { return write_register(folder, members); });
}

Result<Plant> Plant::open(const fs::path& folder) {
  const fs::path file = folder / register_name;
  std::error_code none;
  if (!fs::exists(file, none)) {
    return tl::unexpected(fmt::format(
        "{} is no folder of a plant's trust: it has no {}; `millrace trust init` makes one",
        folder.string(), register_name));
  }
  base::posix::Fd lock;
  try {
    lock = base::posix::lock_folder(folder, lock_name, "another `millrace trust` is at work here");
  } catch (const std::runtime_error& taken) {
    return tl::unexpected(std::string(taken.what()));
  }
  auto members = std::make_unique<config::TrustRegister>();
  if (auto read = base::configuration::read_config(file, *members); !read) {
    return tl::unexpected(read.error());
  }
  return Plant(folder, std::move(lock), std::move(members));
}

const std::string& Plant::name() const {
  return register_->plant();
}

const std::string& Plant::fabric() const {
  return register_->fabric();
}

std::vector<Entry> Plant::entries() const {
  std::vector<Entry> all;
  std::ranges::transform(register_->member(), std::back_inserter(all), &entry_of);
  std::ranges::sort(all, {}, [](const Entry& entry) { return entry.member.name; });
  return all;
}

const config::TrustMember* Plant::find(std::string_view name) const {
  const auto found = std::ranges::find(register_->member(), name, &config::TrustMember::name);
  return found == register_->member().end() ? nullptr : &*found;
}

Result<Entry> Plant::entry(std::string_view name) const {
  const config::TrustMember* record = find(name);
  if (record == nullptr) {
    return tl::unexpected(
        fmt::format("{} has no member \"{}\"; `millrace trust list {}` names them",
                    folder_.string(), name, folder_.string()));
  }
  return entry_of(*record);
}

fs::path Plant::folder_of(std::string_view name) const {
  return folder_ / name;
}

Result<Entry> Plant::issue(const Member& member, const IssueOptions& options,
                           std::string_view passphrase, Time now) {
  if (auto mistake = fabric::trust::mistake_in(member)) {
    return tl::unexpected(*mistake);
  }
  if (member.name == authorities_name || member.name == register_name) {
    return tl::unexpected(
        fmt::format("\"{}\" has another meaning here; take another name", member.name));
  }
  if (find(member.name) != nullptr) {
    return tl::unexpected(
        fmt::format("{} has a member \"{}\" already; `millrace trust renew` makes it new material",
                    folder_.string(), member.name));
  }
  config::TrustMember record;
  record.set_name(member.name);
  for (const fabric::trust::Role role : member.roles) {
    record.add_role(std::string(fabric::trust::name_of(role)));
  }
  for (const std::string& uuid : member.uuids) {
    record.add_uuid(uuid);
  }
  for (const std::string& machine : member.machines) {
    record.add_machine(machine);
  }
  if (!options.host.empty()) {
    record.set_host(options.host);
  }
  if (options.foreign) {
    record.set_foreign(true);
  }
  // Registered before its folder is there: what the authorities have signed is never forgotten.
  config::TrustMember& added = *register_->add_member();
  added = record;
  auto made = make(added, options.days, passphrase, now);
  if (!made) {
    register_->mutable_member()->RemoveLast();
  }
  return made;
}

Result<Entry> Plant::renew(std::string_view name, int days, std::string_view passphrase, Time now) {
  const auto found =
      std::ranges::find(*register_->mutable_member(), name, &config::TrustMember::name);
  if (found == register_->mutable_member()->end()) {
    return entry(name);
  }
  if (found->issue_size() > 0 && all_revoked(*found)) {
    return tl::unexpected(
        fmt::format("\"{}\" has been revoked, and nobody believes that name any more; `millrace "
                    "trust issue` it under another one",
                    name));
  }
  return make(*found, days, passphrase, now);
}

Result<Entry> Plant::make(config::TrustMember& record, int days, std::string_view passphrase,
                          Time now) {
  if (auto checked = check_days(days); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto authorities = Authorities::read(folder_ / authorities_name, passphrase);
  if (!authorities) {
    return tl::unexpected(authorities.error());
  }
  const Time until = std::min(now + std::chrono::days(days), authorities->until());
  if (until <= now) {
    return tl::unexpected(fmt::format(
        "the authorities in {} are no longer valid; `millrace trust renew-authorities {}` "
        "renews them, and all members",
        (folder_ / authorities_name).string(), folder_.string()));
  }
  const Material material = authorities->issue(entry_of(record).member, record.foreign(),
                                               register_->fabric(), now, until, revoked());
  config::Issue& issue = *record.add_issue();
  issue.set_serial(material.serial);
  issue.set_from(seconds_of(now));
  issue.set_until(seconds_of(until));
  auto done = save().and_then(
      [&] { return write_member_folder(folder_of(record.name()), material.files); });
  if (!done) {
    record.mutable_issue()->RemoveLast();
    // What was saved of it does no harm: a serial number that nobody has.
    static_cast<void>(save());
    return tl::unexpected(done.error());
  }
  return entry_of(record);
}

Result<void> Plant::renew_authorities(int days, int member_days, std::string_view passphrase,
                                      Time now) {
  if (auto checked = check_days(days).and_then([&] { return check_days(member_days); }); !checked) {
    return checked;
  }
  const fs::path folder = folder_ / authorities_name;
  auto done = Authorities::read(folder, passphrase).and_then([&](Authorities authorities) {
    authorities.renew(now + std::chrono::days(days));
    return authorities.write_certificates(folder);
  });
  for (config::TrustMember& member : *register_->mutable_member()) {
    if (done && !all_revoked(member)) {
      done = make(member, member_days, passphrase, now).map([](const Entry&) {});
    }
  }
  return done;
}

Result<Time> Plant::authorities_until() const {
  return Authorities::end_of(folder_ / authorities_name);
}

Result<void> Plant::revoke(std::string_view name, std::string_view passphrase, Time now) {
  const auto found =
      std::ranges::find(*register_->mutable_member(), name, &config::TrustMember::name);
  if (found == register_->mutable_member()->end()) {
    return tl::unexpected(entry(name).error());
  }
  const auto authorities = Authorities::read(folder_ / authorities_name, passphrase);
  if (!authorities) {
    return tl::unexpected(authorities.error());
  }
  for (config::Issue& issue : *found->mutable_issue()) {
    if (issue.revoked() == 0) {
      issue.set_revoked(seconds_of(now));
    }
  }
  const std::string list = authorities->revocations(revoked(), now);
  auto done = save();
  for (const config::TrustMember& member : register_->member()) {
    done = done.and_then([&] {
      return base::posix::write_durably(folder_of(member.name()) / fabric::trust::files::revoked,
                                        list);
    });
  }
  return done;
}

std::vector<base::openssl::Revoked> Plant::revoked() const {
  std::vector<base::openssl::Revoked> all;
  for (const config::TrustMember& member : register_->member()) {
    for (const config::Issue& issue : member.issue()) {
      if (issue.revoked() != 0) {
        all.push_back({issue.serial(), time_of(issue.revoked()), member.name()});
      }
    }
  }
  return all;
}

Result<std::string> Plant::archive_of(std::string_view name) const {
  return entry(name).and_then(
      [&](const Entry& entry) { return tar_of(folder_of(name), entry.member.name); });
}

Result<void> Plant::save() const {
  return write_register(folder_, *register_);
}

}  // namespace millrace::tools::trust
