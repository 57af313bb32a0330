// The installed service library: services built against it outside the tree answer over the fabric.
#include <gtest/gtest.h>

#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace {
namespace {

using tests::Process;

class Package : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<tests::TemporaryFolder>();
    Process build({MILLRACE_SOURCE "/tests/integration/package/build", MILLRACE_SOURCE,
                   MILLRACE_BUILD, folder->path(), MILLRACE_SANITIZE});
    ASSERT_EQ(build.wait(std::chrono::minutes(15)), 0) << build.output() << build.error_output();
  }
  static void TearDownTestSuite() { folder.reset(); }

  [[nodiscard]] std::string built(const std::string& name) const { return folder->path() / name; }

  static std::unique_ptr<tests::TemporaryFolder> folder;

  tests::Domain domain;
  std::string number = std::to_string(domain.number());
  tests::Caller caller{domain.number()};
};

std::unique_ptr<tests::TemporaryFolder> Package::folder;

TEST_F(Package, BuildsTheTemplate) {
  const std::string uuid = "b3be5ea2-290f-452a-a581-bf9eecf7df26";
  Process sut({built("template/my-service"), "--domain", number});
  ASSERT_TRUE(caller.await_instance(uuid)) << sut.error_output();
  EXPECT_EQ(caller.call(uuid, "hello").text, "5");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
}

TEST_F(Package, BuildsTheSampleInCAndInCpp) {
  const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  for (const char* name : {"isg_sample", "isg_sample_cpp"}) {
    Process sut({"/usr/bin/env", "MILLRACE_DOMAIN=" + number, built(name)});
    ASSERT_TRUE(caller.await_instance(uuid)) << sut.error_output();
    EXPECT_EQ(caller.call(uuid, "2.25").text, "1.500000");
    sut.terminate();
    EXPECT_EQ(sut.wait(), 0) << sut.error_output();
    ASSERT_TRUE(caller.await_no_instance(uuid));
  }
}

TEST_F(Package, BuildsTheExampleInTheHeaderOfTheCInterface) {
  const std::string uuid = "2b382e8f-107e-4957-a2cf-922e12c6cb98";
  Process sut({"/usr/bin/env", "MILLRACE_DOMAIN=" + number, built("length")});
  sut.await("^ready: length serves " + uuid);
  ASSERT_TRUE(caller.await_instance(uuid)) << sut.error_output();
  EXPECT_EQ(caller.call(uuid, "hello").text, "5");
}

}  // namespace
}  // namespace millrace
