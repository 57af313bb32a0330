#include "tools/trust/pki_files.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/text_format.h>
#include <sys/stat.h>

#include "base/configuration/config_file.hpp"
#include "base/posix/files.hpp"
#include "base/posix/system.hpp"
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

namespace {

template <typename T>
using Result = tl::expected<T, std::string>;

/// The suffix of a folder that is being written.
constexpr std::string_view unfinished = ".part";

/// Of tar: everything is in blocks of this size, and two empty ones end it.
constexpr std::size_t block_size = 512;

/// One field of a header: where, how long, what.
void put(std::array<char, block_size>& header, std::size_t at, std::size_t size,
         std::string_view text) {
  std::ranges::copy(text.substr(0, size), header.begin() + static_cast<std::ptrdiff_t>(at));
}

/// "ustar" as POSIX.1-1988 has it. Names here are shorter than its 100 bytes: a participant's 64
/// and a file's.
std::string header_of(const std::string& name, std::size_t size, mode_t mode, std::int64_t time,
                      char type) {
  std::array<char, block_size> header{};
  put(header, 0, 100, name);
  put(header, 100, 8, fmt::format("{:07o}", mode));
  put(header, 108, 8, fmt::format("{:07o}", 0));
  put(header, 116, 8, fmt::format("{:07o}", 0));
  put(header, 124, 12, fmt::format("{:011o}", size));
  put(header, 136, 12, fmt::format("{:011o}", time));
  put(header, 148, 8, "        ");
  header.at(156) = type;
  put(header, 257, 8, std::string_view("ustar\00000", 8));
  unsigned sum = 0;
  for (const char c : header) {
    sum += static_cast<unsigned char>(c);
  }
  put(header, 148, 8, std::string_view(fmt::format("{:06o}", sum) + '\0' + ' '));
  return {header.data(), header.size()};
}

}  // namespace

Result<void> write_participant_folder(const fs::path& folder,
                                      const std::vector<CredentialFiles::File>& files) {
  const fs::path fresh =
      folder.parent_path() / fmt::format(".{}{}", folder.filename().string(), unfinished);
  std::error_code failed;
  fs::remove_all(fresh, failed);
  if (::mkdir(fresh.c_str(), owner_folder) != 0) {
    return tl::unexpected(base::posix::last_error(fresh.string()));
  }
  for (const CredentialFiles::File& file : files) {
    if (auto written = base::posix::write_durably(fresh / file.name, file.content,
                                                  file.secret ? owner_only : everybody_reads);
        !written) {
      fs::remove_all(fresh, failed);
      return written;
    }
  }
  // Exchanged atomically if there is an old one, which then has the other name.
  const bool renewed = fs::exists(folder, failed);
  if (::renameat2(AT_FDCWD, fresh.c_str(), AT_FDCWD, folder.c_str(),
                  renewed ? RENAME_EXCHANGE : RENAME_NOREPLACE) != 0) {
    const std::string reason = base::posix::last_error(folder.string());
    fs::remove_all(fresh, failed);
    return tl::unexpected(reason);
  }
  if (renewed) {
    fs::remove_all(fresh, failed);
  }
  return {};
}

void remove_unfinished(const fs::path& plant) {
  std::error_code failed;
  std::vector<fs::path> left;
  for (const fs::directory_entry& entry : fs::directory_iterator(plant, failed)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') && name.ends_with(unfinished) && entry.is_directory(failed)) {
      left.push_back(entry.path());
    }
  }
  for (const fs::path& folder : left) {
    fs::remove_all(folder, failed);
  }
}

Result<std::string> tar_of(const fs::path& folder, std::string_view name) {
  std::error_code failed;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    if (entry.is_regular_file(failed)) {
      files.push_back(entry.path());
    }
  }
  if (failed) {
    return tl::unexpected(fmt::format("{}: {}", folder.string(), failed.message()));
  }
  std::ranges::sort(files);
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0) {
    return tl::unexpected(base::posix::last_error(folder.string()));
  }
  constexpr mode_t permission_bits = 07777;
  std::string archive = header_of(fmt::format("{}/", name), 0, status.st_mode & permission_bits,
                                  status.st_mtime, '5');
  for (const fs::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(in), {}};
    if (!in.is_open() || in.bad() || ::stat(file.c_str(), &status) != 0) {
      return tl::unexpected(base::posix::last_error(file.string()));
    }
    archive += header_of(fmt::format("{}/{}", name, file.filename().string()), content.size(),
                         status.st_mode & permission_bits, status.st_mtime, '0');
    archive += content;
    archive.resize((archive.size() + block_size - 1) / block_size * block_size);
  }
  archive.resize(archive.size() + 2 * block_size);
  return archive;
}

}  // namespace millrace::tools::trust
