#include "services/batch/catalog.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/batch/config.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::batch {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

Script script(const std::string& uuid) {
  Script script;
  script.announcement.uuid = uuid;
  return script;
}

TEST(Catalog, ChangesNothingForTheSameScripts) {
  const Changes sut = changes({script("a"), script("b")}, {script("b"), script("a")});
  EXPECT_THAT(sut.stop, IsEmpty());
  EXPECT_THAT(sut.start, IsEmpty());
  EXPECT_THAT(sut.update, IsEmpty());
}

TEST(Catalog, StartsWhatIsNewAndStopsWhatIsGone) {
  const Changes sut = changes({script("a")}, {script("b")});
  EXPECT_THAT(sut.stop, ElementsAre("a"));
  EXPECT_THAT(sut.start, ElementsAre(script("b")));
}

TEST(Catalog, OnlyUpdatesWhatIsRunDifferently) {
  Script changed = script("a");
  changed.time_limit = std::chrono::seconds(5);
  const Changes sut = changes({script("a")}, {changed});
  EXPECT_THAT(sut.stop, IsEmpty());
  EXPECT_THAT(sut.start, IsEmpty());
  EXPECT_THAT(sut.update, ElementsAre(changed));
}

TEST(Catalog, RestartsWhatRegistersDifferently) {
  Script changed = script("a");
  changed.announcement.delivery = fabric::Delivery::at_least_once;
  const Changes sut = changes({script("a")}, {changed});
  EXPECT_THAT(sut.stop, ElementsAre("a"));
  EXPECT_THAT(sut.start, ElementsAre(changed));
}

class CatalogFiles : public testing::Test {
 protected:
  CatalogFiles() {
    std::ofstream(folder / "config") << "x";
    std::ofstream(folder / "program") << "#!/bin/sh\n";
    std::filesystem::permissions(folder / "program", std::filesystem::perms::owner_all);
    scripts[0].program = folder / "program";
  }

  tests::TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  std::vector<Script> scripts{script("a")};
};

TEST_F(CatalogFiles, AreThereIfExecutable) {
  EXPECT_EQ(present(scripts).size(), 1U);
  std::filesystem::permissions(folder / "program", std::filesystem::perms::owner_read);
  EXPECT_THAT(present(scripts), IsEmpty());
}

TEST_F(CatalogFiles, AreNotThereIfMissingOrAFolder) {
  scripts[0].program = folder / "missing";
  EXPECT_THAT(present(scripts), IsEmpty());
  scripts[0].program = folder;
  EXPECT_THAT(present(scripts), IsEmpty());
}

TEST_F(CatalogFiles, ShowEachKindOfChange) {
  const auto print = [&] { return fingerprint(folder / "config", scripts); };
  const std::string before = print();
  EXPECT_EQ(print(), before);

  std::ofstream(folder / "config", std::ios::app) << "y";
  const std::string grown = print();
  EXPECT_NE(grown, before);

  std::filesystem::permissions(folder / "program", std::filesystem::perms::owner_read);
  const std::string locked = print();
  EXPECT_NE(locked, grown);

  std::filesystem::remove(folder / "program");
  EXPECT_NE(print(), locked);
}

std::filesystem::path data(const std::string& name) {
  return tests::test_data("config") / name;
}

TEST(BatchConfig, FillsDefaults) {
  const auto sut = load(data("good/minimal.batch.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  ASSERT_EQ(sut->scripts.size(), 1U);
  const Script& script = sut->scripts[0];
  EXPECT_EQ(script.announcement.uuid, "1b671a64-40d5-491e-99b0-da01ff1f3341");
  EXPECT_EQ(script.announcement.name, "measure.sh");
  EXPECT_EQ(script.announcement.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(script.program, data("good/measure.sh"));
  EXPECT_EQ(script.folder, data("good/"));
  EXPECT_EQ(script.time_limit, 30s);
  EXPECT_EQ(script.too_long, TooLong::refuse);
  EXPECT_EQ(script.encoding, Encoding::utf8);
}

TEST(BatchConfig, ReadsEveryField) {
  const auto sut = load(data("good/full.batch.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  const Script& script = sut->scripts.at(0);
  EXPECT_EQ(script.announcement, (sdk::Announcement{.uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341",
                                                    .name = "measure",
                                                    .description = "Measures a part",
                                                    .channels = {{"cnc", 1}, {"press", 0}},
                                                    .delivery = fabric::Delivery::at_least_once,
                                                    .concurrency = 4}));
  EXPECT_EQ(script.program, "/opt/cell/measure");
  EXPECT_THAT(script.arguments, ElementsAre("--fast", "--"));
  EXPECT_EQ(script.folder, "/srv/cell/work");
  EXPECT_EQ(script.time_limit, 5s);
  EXPECT_EQ(script.too_long, TooLong::cut);
  EXPECT_EQ(script.encoding, Encoding::cp1252);
  EXPECT_TRUE(script.accept_empty);
}

TEST(BatchConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("batch", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::batch
