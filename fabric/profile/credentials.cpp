#include "fabric/profile/credentials.hpp"

#include <cstdlib>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "idl/fabric.pb.h"

namespace millrace::fabric::profile {

namespace {

trust::Protection protection_of(const config::Trust& trust) {
  return trust.protection() == config::Trust::ENCRYPT ? trust::Protection::encrypt
                                                      : trust::Protection::sign;
}

/// Where systemd hands a unit what its LoadCredential= names: systemd.exec(5).
constexpr std::string_view credentials_variable = "$CREDENTIALS_DIRECTORY";

/// A relative folder is beside the file; one that begins with the variable is systemd's.
tl::expected<std::filesystem::path, std::string> folder_of(const std::string& named,
                                                           const std::filesystem::path& file) {
  if (!named.starts_with(credentials_variable)) {
    return file.parent_path() / named;
  }
  const std::string below = named.substr(credentials_variable.size());
  const char* folder = std::getenv(credentials_variable.substr(1).data());
  if (!below.empty() && below.front() != '/') {
    return tl::unexpected(
        fmt::format("\"{}\"; expected {} alone, or a '/' behind it", named, credentials_variable));
  }
  if (folder == nullptr || *folder == '\0') {
    return tl::unexpected(
        fmt::format("{} is not set: systemd sets it for units with LoadCredential= (docs/trust.md "
                    "has the drop-in for them); a program that is started by hand needs a file of "
                    "its own that names a folder: --fabric-config, or MILLRACE_FABRIC_CONFIG",
                    credentials_variable));
  }
  return std::filesystem::path(folder + below);
}

/// Reads the list only when it is another one than at the last look.
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

}  // namespace

tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file) {
  return folder_of(trust.folder(), file).and_then([&](const std::filesystem::path& folder) {
    return trust::read_folder(
        folder, protection_of(trust),
        std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now()));
  });
}

std::shared_ptr<const dds::Trust> trust_of(const trust::Credentials& credentials) {
  return std::make_shared<const dds::Trust>(dds::Trust{
      .name = credentials.name,
      .badge = credentials.badge,
      .until = credentials.until,
      .revoked = [watch = std::make_shared<ListWatch>(credentials.folder)] { return (*watch)(); }});
}

}  // namespace millrace::fabric::profile
