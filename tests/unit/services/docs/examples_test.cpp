// The services accept the configurations of docs/reference/services, docs/how-to and
// deploy/examples.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "services/archiver/config.hpp"
#include "services/batch/config.hpp"
#include "services/dial_gauge/config.hpp"
#include "services/http/config.hpp"
#include "services/lcm/config.hpp"
#include "services/mail/config.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services {
namespace {

/// Writes the example that begins with "# NAME" to a file of that name.
std::filesystem::path example(const tests::TemporaryFolder& folder, const std::string& name,
                              const std::string& page) {
  std::ifstream in(std::string(MILLRACE_DOCS) + "/" + page);
  std::stringstream text;
  text << in.rdbuf();
  const std::string docs = text.str();
  const std::size_t start = docs.find("```textproto\n# " + name + "\n");
  if (start == std::string::npos) {
    throw std::runtime_error("docs/" + page + " shows no " + name);
  }
  const std::size_t first = docs.find('\n', start) + 1;
  const std::filesystem::path file = folder.path() / name;
  std::ofstream(file) << docs.substr(first, docs.find("```", first) - first);
  return file;
}

TEST(DocumentedConfiguration, OfBatchIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut = batch::load(example(folder, "batch.textproto", "reference/services/batch.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->scripts.size(), 2U);
}

TEST(DocumentedConfiguration, OfDialGaugesIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut =
      dial_gauge::load(example(folder, "dial_gauge.textproto", "reference/services/dial-gauge.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->gauges.size(), 2U);
}

TEST(DocumentedConfiguration, OfTheArchiverIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut =
      archiver::load(example(folder, "archiver.textproto", "reference/services/archiver.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->folder, "/var/lib/millrace/archiver/archive");
}

TEST(DocumentedConfiguration, OfHttpIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut = http::load(example(folder, "http.textproto", "reference/services/http.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->size(), 3U);
}

TEST(DocumentedConfiguration, OfMailIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut = mail::load(example(folder, "mail.textproto", "reference/services/mail.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->templates.size(), 2U);
  EXPECT_EQ(sut->spool, "/var/lib/millrace/mail/spool");
}

TEST(DocumentedConfiguration, OfTheBridgeToLcmIsAccepted) {
  const tests::TemporaryFolder folder;
  const auto sut = lcm::load(example(folder, "lcm.textproto", "how-to/services-with-lcm.md"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->network.interface, "10.77.0.5");
}

std::filesystem::path installed(const std::string& name) {
  return std::filesystem::path(MILLRACE_EXAMPLES) / name;
}

TEST(ExampleConfiguration, OfEachServiceIsAccepted) {
  EXPECT_EQ(batch::load(installed("batch.textproto")).value().scripts.size(), 1U);
  EXPECT_EQ(dial_gauge::load(installed("dial_gauge.textproto")).value().gauges.size(), 2U);
  EXPECT_EQ(archiver::load(installed("archiver.textproto")).value().folder,
            "/var/lib/millrace/archiver/archive");
  EXPECT_EQ(http::load(installed("http.textproto")).value().size(), 1U);
  EXPECT_EQ(lcm::load(installed("lcm.textproto")).value().rules.services.size(), 1U);
  EXPECT_EQ(mail::load(installed("mail.textproto")).value().templates.size(), 1U);
}

/// The command line of each example's systemd unit is one of our programs with flags that name
/// files.
TEST(ExampleConfiguration, OfEachUnitNamesItsFile) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(installed("services"))) {
    std::ifstream in(entry.path());
    for (std::string line; std::getline(in, line);) {
      const std::string config = "FLAGS=--config /etc/millrace/";
      if (line.starts_with(config)) {
        EXPECT_TRUE(std::filesystem::exists(installed(line.substr(config.size())))) << line;
        ++count;
      }
    }
  }
  EXPECT_EQ(count, 6U);
}

}  // namespace
}  // namespace millrace::services
