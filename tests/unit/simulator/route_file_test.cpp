// The file with the routes of a virtual CNC.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>

#include "cnc/simulator/host_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::cnc::simulator {
namespace {

using testing::HasSubstr;

class RouteFile : public testing::Test {
 protected:
  std::shared_ptr<ads::Routes> read() { return read_routes(file, log); }
  [[nodiscard]] std::string text() const {
    std::ostringstream all;
    all << std::ifstream(file).rdbuf();
    return all.str();
  }

  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "routes";
  base::program::Log log =
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::null_sink_mt>());
};

TEST_F(RouteFile, IsEmptyWhileItDoesNotExist) {
  EXPECT_THAT(read()->all(), testing::IsEmpty());
}

TEST_F(RouteFile, KeepsItsRoutesWhenAnotherOneIsAdded) {
  std::ofstream(file) << "192.168.10.20.1.1\n";
  const auto sut = read();
  ASSERT_EQ(sut->all().size(), 1U);
  sut->add({*ads::NetId::parse("192.168.10.21.1.1"), ""});
  EXPECT_THAT(text(), HasSubstr("192.168.10.20.1.1"));
  EXPECT_THAT(text(), HasSubstr("192.168.10.21.1.1"));
}

TEST_F(RouteFile, ThatCannotBeReadIsAnErrorAndNotEmpty) {
  std::filesystem::create_directory(file);
  try {
    read();
    FAIL() << "a folder is not a file of routes";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("routes: the file of routes cannot be read"));
  }
}

}  // namespace
}  // namespace millrace::cnc::simulator
