#include "services/batch/catalog.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace millrace::services::batch {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Script script(const std::string& uuid) {
  Script script;
  script.registration.uuid = uuid;
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
  changed.registration.delivery = fabric::Delivery::at_least_once;
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

}  // namespace
}  // namespace millrace::services::batch
