#include "base/posix/file_identity.hpp"

#include <sys/stat.h>

namespace millrace::base::posix {

FileIdentity identity_of(const std::filesystem::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? FileIdentity(status.st_dev, status.st_ino)
                                            : FileIdentity{};
}

}  // namespace millrace::base::posix
