#include "tools/trust/plant.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/posix/durable_file.hpp"
#include "base/posix/folder_lock.hpp"
#include "base/text/characters.hpp"
#include "base/text/quoted.hpp"
#include "fabric/trust/folder.hpp"
#include "idl/trust.pb.h"
#include "tools/trust/member_folder.hpp"
#include "tools/trust/register.hpp"

namespace millrace::tools::trust {

namespace {

namespace fs = std::filesystem;
using fabric::trust::Member;

template <typename T>
using Result = tl::expected<T, std::string>;

constexpr const char* authorities_name = "authorities";
constexpr const char* lock_name = ".lock";
constexpr int most_days = 36'500;

std::int64_t seconds_of(Time time) {
  return time.time_since_epoch().count();
}

Result<void> check_days(int days) {
  if (days < 1 || days > most_days) {
    return tl::unexpected(fmt::format("{} days; expected 1 to {}", days, most_days));
  }
  return {};
}

/// Draws the keys; the plant's name is what a certificate can hold, and a line can show.
Result<Authorities> create_authorities(std::string_view name, Time from, Time until) {
  const auto refuse = [name](std::string_view why) {
    return tl::unexpected(fmt::format(
        "\"{}\" is no name of a plant ({}): expected 1 to 64 characters of UTF-8 without control "
        "characters; `--name` gives one that is not the folder's",
        base::text::safe(name), why));
  };
  if (name.empty()) {
    return refuse("it is empty");
  }
  if (std::ranges::any_of(name, &base::text::is_control)) {
    return refuse("it has a control character");
  }
  try {
    return Authorities::create(name, from, until);
  } catch (const std::invalid_argument& what) {
    return refuse(what.what());
  }
}

/// A folder that is not there yet, or is empty; returns whether it was made.
Result<bool> make_empty_folder(const fs::path& folder) {
  std::error_code failed;
  if (fs::exists(folder, failed)) {
    if (fs::is_directory(folder, failed) && fs::is_empty(folder, failed)) {
      ::chmod(folder.c_str(), owner_folder);
      return false;
    }
    if (fs::exists(folder / authorities_name, failed) &&
        !fs::exists(folder / register_name, failed)) {
      return tl::unexpected(fmt::format(
          "{0} is there already, and has authorities but no {1}: `millrace trust init` did not "
          "come "
          "to its end here; nobody has got anything of them, so remove {0} and say it again",
          folder.string(), register_name));
    }
    return tl::unexpected(fmt::format(
        "{} is there already; the authorities of a plant are never overwritten", folder.string()));
  }
  fs::create_directories(folder, failed);
  if (failed || ::chmod(folder.c_str(), owner_folder) != 0) {
    return tl::unexpected(
        fmt::format("{}: cannot be created ({})", folder.string(), failed.message()));
  }
  return true;
}

tl::unexpected<std::string> refuse_revoked(std::string_view name) {
  return tl::unexpected(fmt::format(
      "\"{}\" has been revoked, and nobody believes that name any more; `millrace trust "
      "issue` it under another one",
      name));
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
  const auto authorities = create_authorities(name, now, now + std::chrono::days(days));
  if (!authorities) {
    return tl::unexpected(authorities.error());
  }
  const auto made = make_empty_folder(folder);
  if (!made) {
    return tl::unexpected(made.error());
  }
  config::TrustRegister members;
  members.set_plant(std::string(name));
  members.set_fabric(std::string(fabric));
  // The register comes last: a folder without one is not taken for a plant.
  auto done = authorities->write(folder / authorities_name, passphrase)
                  .and_then([&] {
                    return base::posix::write_durably(folder / fabric::trust::files::revoked,
                                                      authorities->revocations({}, now));
                  })
                  .and_then([&] { return write_register(folder, members); });
  if (!done) {
    std::error_code none;
    fs::remove_all(folder / authorities_name, none);
    fs::remove(folder / fabric::trust::files::revoked, none);
    if (*made) {
      fs::remove(folder, none);
    }
  }
  return done;
}

Result<Plant> Plant::look(const fs::path& folder) {
  return read_register(folder).map([&](std::unique_ptr<config::TrustRegister> members) {
    return Plant(folder, {}, std::move(members));
  });
}

Result<Plant> Plant::open(const fs::path& folder) {
  // What is no plant gets no lock.
  if (auto looked = read_register(folder); !looked) {
    return tl::unexpected(looked.error());
  }
  base::posix::Fd lock;
  try {
    lock = base::posix::lock_folder(
        folder, lock_name,
        "another `millrace trust` is at work here; say it again when that has ended");
  } catch (const std::runtime_error& taken) {
    return tl::unexpected(std::string(taken.what()));
  }
  remove_unfinished(folder);
  return read_register(folder).map([&](std::unique_ptr<config::TrustRegister> members) {
    return Plant(folder, std::move(lock), std::move(members));
  });
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

config::TrustMember* Plant::find_to_change(std::string_view name) {
  const auto found =
      std::ranges::find(*register_->mutable_member(), name, &config::TrustMember::name);
  return found == register_->mutable_member()->end() ? nullptr : &*found;
}

Result<Authorities> Plant::authorities(std::string_view passphrase) const {
  return Authorities::read(folder_ / authorities_name, passphrase);
}

Result<Entry> Plant::issue(const Member& member, const IssueOptions& options,
                           std::string_view passphrase, Time now) {
  if (auto mistake = fabric::trust::mistake_in(member)) {
    return tl::unexpected(*mistake);
  }
  for (const std::string_view other :
       {std::string_view(authorities_name), std::string_view(register_name),
        fabric::trust::files::revoked}) {
    if (member.name == other) {
      return tl::unexpected(
          fmt::format("\"{}\" has another meaning here; take another name", member.name));
    }
  }
  if (find(member.name) != nullptr) {
    return tl::unexpected(
        fmt::format("{} has a member \"{}\" already; `millrace trust renew` makes it new material, "
                    "and `issue --renew` has it be what that says",
                    folder_.string(), member.name));
  }
  // Registered before its folder is there: what the authorities have signed is never forgotten.
  config::TrustMember& added = *register_->add_member();
  describe(added, member, options);
  auto made = make_and_tell(added, options.days, passphrase, now);
  if (!made && added.issue_size() == 0) {
    register_->mutable_member()->RemoveLast();
    static_cast<void>(save());
  }
  return made;
}

Result<Entry> Plant::renew(std::string_view name, int days, std::string_view passphrase, Time now) {
  config::TrustMember* const found = find_to_change(name);
  if (found == nullptr) {
    return entry(name);
  }
  if (is_revoked(*found)) {
    return refuse_revoked(name);
  }
  return make_and_tell(*found, days, passphrase, now);
}

Result<Entry> Plant::reissue(const Member& member, const IssueOptions& options,
                             std::string_view passphrase, Time now) {
  config::TrustMember* const found = find_to_change(member.name);
  if (found == nullptr) {
    return entry(member.name);
  }
  if (auto mistake = fabric::trust::mistake_in(member)) {
    return tl::unexpected(*mistake);
  }
  if (is_revoked(*found)) {
    return refuse_revoked(member.name);
  }
  const config::TrustMember before = *found;
  describe(*found, member, options);
  auto made = make_and_tell(*found, options.days, passphrase, now);
  if (!made && found->issue_size() == before.issue_size()) {
    *found = before;
    static_cast<void>(save());
  }
  return made;
}

Result<Entry> Plant::make_and_tell(config::TrustMember& record, int days,
                                   std::string_view passphrase, Time now) {
  return authorities(passphrase).and_then([&](const Authorities& authorities) {
    return make(record, days, authorities, now).and_then([&](const Entry& entry) {
      return spread_list(authorities, now).map([&] { return entry; });
    });
  });
}

Result<Entry> Plant::make(config::TrustMember& record, int days, const Authorities& authorities,
                          Time now) {
  if (auto checked = check_days(days); !checked) {
    return tl::unexpected(checked.error());
  }
  const Time until = std::min(now + std::chrono::days(days), authorities.until());
  if (until <= now) {
    return tl::unexpected(fmt::format(
        "the authorities in {} are no longer valid; `millrace trust renew-authorities {}` "
        "renews them, and all members",
        (folder_ / authorities_name).string(), folder_.string()));
  }
  const Material material =
      authorities.issue(entry_of(record).member, record.foreign(), register_->fabric(), now, until,
                        revoked_in(*register_));
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
  auto renewed = authorities(passphrase);
  if (!renewed) {
    return tl::unexpected(renewed.error());
  }
  renewed->renew(now + std::chrono::days(days));
  auto done = renewed->write_certificates(folder_ / authorities_name);
  for (config::TrustMember& member : *register_->mutable_member()) {
    if (done && !is_revoked(member)) {
      done = make(member, member_days, *renewed, now).map([](const Entry&) {});
    }
  }
  return done.and_then([&] { return spread_list(*renewed, now); });
}

Result<Time> Plant::authorities_until() const {
  return Authorities::end_of(folder_ / authorities_name);
}

Result<void> Plant::revoke(std::string_view name, std::string_view passphrase, Time now) {
  config::TrustMember* const found = find_to_change(name);
  if (found == nullptr) {
    return tl::unexpected(entry(name).error());
  }
  return authorities(passphrase).and_then([&](const Authorities& authorities) {
    const config::TrustMember before = *found;
    for (config::Issue& issue : *found->mutable_issue()) {
      if (issue.revoked() == 0) {
        issue.set_revoked(seconds_of(now));
      }
    }
    if (auto saved = save(); !saved) {
      *found = before;
      return saved;
    }
    return spread_list(authorities, now);
  });
}

Result<void> Plant::spread_list(const Authorities& authorities, Time now) const {
  const std::string list = authorities.revocations(revoked_in(*register_), now);
  const auto write = [&](const fs::path& folder) {
    return base::posix::write_durably(folder / fabric::trust::files::revoked, list,
                                      everybody_reads);
  };
  auto done = write(folder_);
  for (const config::TrustMember& member : register_->member()) {
    // Who has moved it to its host has it no more; the plant's own is the same.
    std::error_code none;
    if (fs::is_directory(folder_of(member.name()), none)) {
      auto written = write(folder_of(member.name()));
      // As many as can be told are told.
      done = done ? written : done;
    }
  }
  return done;
}

Result<std::string> Plant::archive_of(std::string_view name) const {
  return entry(name).and_then([&](const Entry& entry) -> Result<std::string> {
    std::error_code none;
    if (!fs::is_directory(folder_of(name), none)) {
      return tl::unexpected(fmt::format(
          "{}: is not there; `millrace trust renew` makes its content anew, if no host has it",
          folder_of(name).string()));
    }
    return tar_of(folder_of(name), entry.member.name);
  });
}

Result<void> Plant::save() const {
  return write_register(folder_, *register_);
}

}  // namespace millrace::tools::trust
