// A PKI in a temporary folder, for tests of the commands on its admin host and of the checks on
// other hosts.
//
//   TEST_F(PkiFolderTest, …) { create(); open().issue(service(), {}, {}, now).value(); }
#pragma once

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "fabric/trust/folder.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/trust/pki_folder.hpp"

namespace millrace::tools::trust {

using namespace std::chrono_literals;
using fabric::trust::Participant;
using fabric::trust::Protection;
using fabric::trust::read_folder;
using fabric::trust::Role;
namespace fs = std::filesystem;

inline constexpr Time now{1'800'000'000s};
inline const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

inline std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline mode_t mode_of(const fs::path& file) {
  struct stat status {};
  EXPECT_EQ(::stat(file.c_str(), &status), 0) << file;
  return status.st_mode & 07777U;
}

/// No file grows beyond this, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : before_(std::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &limits_), 0);
    const rlimit tight{bytes, limits_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &limits_);
    std::signal(SIGXFSZ, before_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit limits_{};
  void (*before_)(int);
};

class PkiFolderTest : public testing::Test {
 protected:
  [[nodiscard]] PkiFolder open() const {
    auto pki = PkiFolder::open(folder);
    if (!pki) {
      throw std::runtime_error(pki.error());
    }
    return std::move(*pki);
  }
  void create(std::string_view passphrase = {}) const {
    const auto made = PkiFolder::create(folder, "plant", "millrace", 3650, passphrase, now);
    ASSERT_TRUE(made) << made.error();
  }
  static Participant service(const std::string& name = "root") {
    return {.name = name, .roles = {Role::service}, .uuids = {uuid}};
  }
  [[nodiscard]] std::string why_refused(std::string_view name = "root",
                                        Time when = now + 1h) const {
    const auto read = read_folder(folder / name, Protection::sign, when);
    return read ? "not refused" : read.error();
  }

  tests::TemporaryFolder temporary;
  fs::path folder = temporary.path() / "plant";
};

}  // namespace millrace::tools::trust
