#include "fabric/profile/credentials.hpp"

#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <sys/stat.h>

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

}  // namespace

tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file) {
  return base::configuration::place_of(trust.folder(), file.parent_path())
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
