#include "fabric/profile/credentials.hpp"

#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/configuration/mistakes.hpp"
#include "idl/fabric.pb.h"

namespace millrace::fabric::profile {

namespace {

trust::Protection protection_of(const config::Trust& trust) {
  return trust.protection() == config::Trust::ENCRYPT ? trust::Protection::encrypt
                                                      : trust::Protection::sign;
}

/// Reads the CRL only when its file has changed since the last check.
class ListWatch {
 public:
  explicit ListWatch(std::filesystem::path folder) : folder_(std::move(folder)) {}

  tl::expected<std::set<std::string>, std::string> operator()() {
    struct stat now {};
    const bool there = ::stat((folder_ / trust::files::revoked).c_str(), &now) == 0;
    const Version version{there, now.st_ino, now.st_size, now.st_mtim.tv_sec, now.st_mtim.tv_nsec};
    if (version != version_) {
      version_ = version;
      last_ = trust::read_revoked(folder_);
    }
    return last_;
  }

 private:
  using Version = std::tuple<bool, ino_t, off_t, time_t, long>;
  std::filesystem::path folder_;
  std::optional<Version> version_;
  tl::expected<std::set<std::string>, std::string> last_;
};

constexpr std::string_view credentials_of_unit = "$CREDENTIALS_DIRECTORY";

/// The folders of users in `trust`, with their owners, by name.
std::map<std::string, uid_t> folders_of_users(const std::filesystem::path& trust) {
  std::map<std::string, uid_t> folders;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(trust, none)) {
    const std::string name = entry.path().filename().string();
    struct stat status {};
    if (!name.starts_with('.') && !name.starts_with("millrace-") &&
        ::stat(entry.path().c_str(), &status) == 0 && S_ISDIR(status.st_mode)) {
      folders.emplace(name, status.st_uid);
    }
  }
  return folders;
}

}  // namespace

tl::expected<std::filesystem::path, std::string> credentials_of_user(
    const std::filesystem::path& trust, uid_t user) {
  std::vector<std::string> own;
  std::vector<std::string> all;
  for (const auto& [name, owner] : folders_of_users(trust)) {
    all.push_back(name);
    if (owner == user) {
      own.push_back(name);
    }
  }
  constexpr uid_t root = 0;
  const std::vector<std::string>& usable = own.empty() && user == root ? all : own;
  if (usable.size() == 1) {
    return trust / usable.front();
  }
  if (usable.empty()) {
    return tl::unexpected(
        fmt::format("{} is not set: systemd sets it for units. For processes that a user starts, "
                    "`/usr/share/millrace/install-trust --owner USER NAME` installs credentials in "
                    "{}, where the user {} has none (docs/how-to/secure-a-network.md)",
                    credentials_of_unit, trust.string(), user));
  }
  return tl::unexpected(
      fmt::format("{} is not set, and {} has several folders for the user {}: {}; name one of them "
                  "in a fabric file of its own (--fabric-config)",
                  credentials_of_unit, trust.string(), user, fmt::join(usable, ", ")));
}

tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file) {
  return base::configuration::place_of(trust.folder(), file.parent_path())
      .or_else([&](const std::string& error) -> tl::expected<std::filesystem::path, std::string> {
        return trust.folder() == credentials_of_unit ? credentials_of_user(host_trust, ::geteuid())
                                                     : tl::unexpected(error);
      })
      .and_then([&](const std::filesystem::path& folder) {
        return trust::read_folder(
            folder, protection_of(trust),
            std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now()));
      });
}

std::shared_ptr<const dds::Trust> trust_of(const trust::Credentials& credentials) {
  return std::make_shared<const dds::Trust>(dds::Trust{
      .name = credentials.name,
      .identity_partitions = credentials.identity_partitions,
      .until = credentials.until,
      .revoked = [watch = std::make_shared<ListWatch>(credentials.folder)] { return (*watch)(); }});
}

}  // namespace millrace::fabric::profile
