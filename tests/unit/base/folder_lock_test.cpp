#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/posix/files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::posix {
namespace {

using testing::EndsWith;
using testing::Property;
using testing::Throws;

TEST(FolderLock, IsHeldOnceAndReleasedWithItsDescriptor) {
  const tests::TemporaryFolder folder;
  Fd sut = lock_folder(folder.path(), "x.lock", "taken");
  EXPECT_THAT([&] { lock_folder(folder.path(), "x.lock", "another one writes here"); },
              Throws<std::runtime_error>(
                  Property(&std::exception::what, EndsWith(": another one writes here"))));
  EXPECT_TRUE(lock_folder(folder.path(), "y.lock", "taken"));
  sut.close();
  EXPECT_TRUE(lock_folder(folder.path(), "x.lock", "taken"));
}

TEST(FolderLock, NeedsAFolder) {
  EXPECT_THROW(lock_folder("/no/such/folder", "x.lock", "taken"), std::runtime_error);
}

}  // namespace
}  // namespace millrace::base::posix
