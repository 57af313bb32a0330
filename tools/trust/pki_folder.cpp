#include "tools/trust/pki_folder.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/posix/files.hpp"
#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"
#include "fabric/trust/folder.hpp"
#include "idl/trust.pb.h"
#include "tools/trust/pki_files.hpp"

namespace millrace::tools::trust {

namespace {

namespace fs = std::filesystem;
using fabric::trust::Participant;

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

/// Creates the keys; the PKI's name must fit into a certificate and a line.
Result<CertificateAuthorities> create_authorities(std::string_view name, Time from, Time until) {
  const auto refuse = [name](std::string_view why) {
    return tl::unexpected(
        fmt::format("\"{}\" is not a PKI name ({}): expected 1 to 64 characters of UTF-8 without "
                    "control characters; `--name` gives one that is not the folder's",
                    base::text::safe(name), why));
  };
  if (name.empty()) {
    return refuse("it is empty");
  }
  if (std::ranges::any_of(name, &base::text::is_control)) {
    return refuse("it has a control character");
  }
  try {
    return CertificateAuthorities::create(name, from, until);
  } catch (const std::invalid_argument& what) {
    return refuse(what.what());
  }
}

/// A folder that does not exist yet, or is empty; returns whether it was created.
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
          "{0} exists, and has CAs but no {1}: `millrace trust init` did not finish here and no "
          "participant has a certificate; remove {0} and run the command again",
          folder.string(), register_name));
    }
    return tl::unexpected(
        fmt::format("{} exists already; the CAs of a PKI are never overwritten", folder.string()));
  }
  fs::create_directories(folder, failed);
  if (failed || ::chmod(folder.c_str(), owner_folder) != 0) {
    return tl::unexpected(
        fmt::format("{}: cannot be created ({})", folder.string(), failed.message()));
  }
  return true;
}

tl::unexpected<std::string> refuse_revoked(std::string_view name) {
  return tl::unexpected(
      fmt::format("\"{}\" was revoked, and no process accepts that name any more; issue it under "
                  "another name with `millrace trust issue`",
                  name));
}

}  // namespace

PkiFolder::PkiFolder(fs::path folder, base::posix::Fd lock,
                     std::unique_ptr<config::TrustRegister> participants)
    : folder_(std::move(folder)), lock_(std::move(lock)), register_(std::move(participants)) {}
PkiFolder::PkiFolder(PkiFolder&&) noexcept = default;
PkiFolder& PkiFolder::operator=(PkiFolder&&) noexcept = default;
PkiFolder::~PkiFolder() = default;

Result<void> PkiFolder::create(const fs::path& folder, std::string_view name,
                               std::string_view fabric, int days, std::string_view passphrase,
                               Time now) {
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
  config::TrustRegister participants;
  participants.set_plant(std::string(name));
  participants.set_fabric(std::string(fabric));
  // The register comes last: a folder without one is not a PKI folder.
  auto done = authorities->write(folder / authorities_name, passphrase)
                  .and_then([&] {
                    return base::posix::write_durably(folder / fabric::trust::files::revoked,
                                                      authorities->revocations({}, now));
                  })
                  .and_then([&] { return write_register(folder, participants); });
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

Result<PkiFolder> PkiFolder::look(const fs::path& folder) {
  return read_register(folder).map([&](std::unique_ptr<config::TrustRegister> participants) {
    return PkiFolder(folder, {}, std::move(participants));
  });
}

Result<PkiFolder> PkiFolder::open(const fs::path& folder) {
  // Without a register there is no lock.
  if (auto looked = read_register(folder); !looked) {
    return tl::unexpected(looked.error());
  }
  base::posix::Fd lock;
  try {
    lock = base::posix::lock_folder(
        folder, lock_name,
        "another `millrace trust` uses this folder; run the command again when that has ended");
  } catch (const std::runtime_error& taken) {
    return tl::unexpected(std::string(taken.what()));
  }
  remove_unfinished(folder);
  return read_register(folder).map([&](std::unique_ptr<config::TrustRegister> participants) {
    return PkiFolder(folder, std::move(lock), std::move(participants));
  });
}

const std::string& PkiFolder::name() const {
  return register_->plant();
}

const std::string& PkiFolder::fabric() const {
  return register_->fabric();
}

std::vector<Entry> PkiFolder::entries() const {
  std::vector<Entry> all;
  std::ranges::transform(register_->participant(), std::back_inserter(all), &entry_of);
  std::ranges::sort(all, {}, [](const Entry& entry) { return entry.participant.name; });
  return all;
}

const config::TrustParticipant* PkiFolder::find(std::string_view name) const {
  const auto found =
      std::ranges::find(register_->participant(), name, &config::TrustParticipant::name);
  return found == register_->participant().end() ? nullptr : &*found;
}

Result<Entry> PkiFolder::entry(std::string_view name) const {
  const config::TrustParticipant* record = find(name);
  if (record == nullptr) {
    return tl::unexpected(
        fmt::format("{} has no participant \"{}\"; `millrace trust list {}` lists them",
                    folder_.string(), name, folder_.string()));
  }
  return entry_of(*record);
}

fs::path PkiFolder::folder_of(std::string_view name) const {
  return folder_ / name;
}

config::TrustParticipant* PkiFolder::find_to_change(std::string_view name) {
  const auto found =
      std::ranges::find(*register_->mutable_participant(), name, &config::TrustParticipant::name);
  return found == register_->mutable_participant()->end() ? nullptr : &*found;
}

Result<CertificateAuthorities> PkiFolder::authorities(std::string_view passphrase) const {
  return CertificateAuthorities::read(folder_ / authorities_name, passphrase);
}

Result<Entry> PkiFolder::issue(const Participant& participant, const IssueOptions& options,
                               std::string_view passphrase, Time now) {
  if (auto mistake = fabric::trust::mistake_in(participant)) {
    return tl::unexpected(*mistake);
  }
  for (const std::string_view other :
       {std::string_view(authorities_name), std::string_view(register_name),
        fabric::trust::files::revoked}) {
    if (participant.name == other) {
      return tl::unexpected(
          fmt::format("\"{}\" is a reserved name here; choose another name", participant.name));
    }
  }
  if (find(participant.name) != nullptr) {
    return tl::unexpected(
        fmt::format("{} has a participant \"{}\" already; `millrace trust renew` renews its "
                    "credentials, and `issue --renew` also changes its rights",
                    folder_.string(), participant.name));
  }
  // Registered before its folder exists: no signature of the CAs is ever forgotten.
  config::TrustParticipant& added = *register_->add_participant();
  describe(added, participant, options);
  auto made = make_and_report(added, options.days, passphrase, now);
  if (!made && added.issue_size() == 0) {
    register_->mutable_participant()->RemoveLast();
    static_cast<void>(save());
  }
  return made;
}

Result<Entry> PkiFolder::renew(std::string_view name, int days, std::string_view passphrase,
                               Time now) {
  config::TrustParticipant* const found = find_to_change(name);
  if (found == nullptr) {
    return entry(name);
  }
  if (is_revoked(*found)) {
    return refuse_revoked(name);
  }
  return make_and_report(*found, days, passphrase, now);
}

Result<Entry> PkiFolder::reissue(const Participant& participant, const IssueOptions& options,
                                 std::string_view passphrase, Time now) {
  config::TrustParticipant* const found = find_to_change(participant.name);
  if (found == nullptr) {
    return entry(participant.name);
  }
  if (auto mistake = fabric::trust::mistake_in(participant)) {
    return tl::unexpected(*mistake);
  }
  if (is_revoked(*found)) {
    return refuse_revoked(participant.name);
  }
  const config::TrustParticipant before = *found;
  describe(*found, participant, options);
  auto made = make_and_report(*found, options.days, passphrase, now);
  if (!made && found->issue_size() == before.issue_size()) {
    *found = before;
    static_cast<void>(save());
  }
  return made;
}

Result<Entry> PkiFolder::make_and_report(config::TrustParticipant& record, int days,
                                         std::string_view passphrase, Time now) {
  return authorities(passphrase).and_then([&](const CertificateAuthorities& authorities) {
    return make(record, days, authorities, now).and_then([&](const Entry& entry) {
      return spread_list(authorities, now).map([&] { return entry; });
    });
  });
}

Result<Entry> PkiFolder::make(config::TrustParticipant& record, int days,
                              const CertificateAuthorities& authorities, Time now) {
  if (auto checked = check_days(days); !checked) {
    return tl::unexpected(checked.error());
  }
  const Time until = std::min(now + std::chrono::days(days), authorities.until());
  if (until <= now) {
    return tl::unexpected(
        fmt::format("the CAs in {} have expired; `millrace trust renew-authorities {}` renews them "
                    "and all participants",
                    (folder_ / authorities_name).string(), folder_.string()));
  }
  const CredentialFiles credential_files =
      authorities.issue(entry_of(record).participant, record.foreign(), register_->fabric(), now,
                        until, revoked_in(*register_));
  config::Issue& issue = *record.add_issue();
  issue.set_serial(credential_files.serial);
  issue.set_from(seconds_of(now));
  issue.set_until(seconds_of(until));
  auto done = save().and_then(
      [&] { return write_participant_folder(folder_of(record.name()), credential_files.files); });
  if (!done) {
    record.mutable_issue()->RemoveLast();
    // A saved entry does no harm: its serial number has no certificate.
    static_cast<void>(save());
    return tl::unexpected(done.error());
  }
  return entry_of(record);
}

Result<void> PkiFolder::renew_authorities(int days, int participant_days,
                                          std::string_view passphrase, Time now) {
  if (auto checked = check_days(days).and_then([&] { return check_days(participant_days); });
      !checked) {
    return checked;
  }
  auto renewed = authorities(passphrase);
  if (!renewed) {
    return tl::unexpected(renewed.error());
  }
  renewed->renew(now + std::chrono::days(days));
  auto done = renewed->write_certificates(folder_ / authorities_name);
  for (config::TrustParticipant& participant : *register_->mutable_participant()) {
    if (done && !is_revoked(participant)) {
      done = make(participant, participant_days, *renewed, now).map([](const Entry&) {});
    }
  }
  return done.and_then([&] { return spread_list(*renewed, now); });
}

Result<Time> PkiFolder::authorities_until() const {
  return CertificateAuthorities::end_of(folder_ / authorities_name);
}

Result<void> PkiFolder::revoke(std::string_view name, std::string_view passphrase, Time now) {
  config::TrustParticipant* const found = find_to_change(name);
  if (found == nullptr) {
    return tl::unexpected(entry(name).error());
  }
  return authorities(passphrase).and_then([&](const CertificateAuthorities& authorities) {
    const config::TrustParticipant before = *found;
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

Result<void> PkiFolder::spread_list(const CertificateAuthorities& authorities, Time now) const {
  const std::string list = authorities.revocations(revoked_in(*register_), now);
  const auto write = [&](const fs::path& folder) {
    return base::posix::write_durably(folder / fabric::trust::files::revoked, list,
                                      everybody_reads);
  };
  auto done = write(folder_);
  for (const config::TrustParticipant& participant : register_->participant()) {
    // A folder that was moved to its host is missing here; the PKI folder's own file is the same.
    std::error_code none;
    if (fs::is_directory(folder_of(participant.name()), none)) {
      auto written = write(folder_of(participant.name()));
      // Errors do not stop the others.
      done = done ? written : done;
    }
  }
  return done;
}

Result<std::string> PkiFolder::archive_of(std::string_view name) const {
  return entry(name).and_then([&](const Entry& entry) -> Result<std::string> {
    std::error_code none;
    if (!fs::is_directory(folder_of(name), none)) {
      return tl::unexpected(
          fmt::format("{}: is missing; `millrace trust renew` creates it again, if no host has it",
                      folder_of(name).string()));
    }
    return tar_of(folder_of(name), entry.participant.name);
  });
}

Result<void> PkiFolder::save() const {
  return write_register(folder_, *register_);
}

}  // namespace millrace::tools::trust
