#include "tools/web/live/acknowledgement_file.hpp"

#include <fstream>
#include <memory>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include "base/messages/catalogue.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tools::web::live {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class AnAcknowledgementFile : public testing::Test {
 protected:
  AnAcknowledgementFile() { sut.emplace(folder.path() / "web", log); }

  void acknowledge(const std::string& cause, const std::string& note) {
    plant.acknowledge(
        {.cause = cause, .name = "cnc/1", .since = "1772348400000", .by = "anna", .note = note},
        fabric::Time(std::chrono::nanoseconds(1'772'348'460'123'456'789)));
    sut->store(plant.acknowledged());
  }
  /// As a server that starts again.
  AcknowledgementFile::List after_restart() {
    sut.reset();
    sut.emplace(folder.path() / "web", log);
    return sut->load();
  }
  void damage(const std::string& text) const { std::ofstream(file) << text; }

  const tests::TemporaryFolder folder;
  const fs::path file = folder.path() / "web" / "acknowledged.json";
  std::ostringstream lines;
  base::program::Log log = std::make_shared<spdlog::logger>(
      "web", std::make_shared<spdlog::sinks::ostream_sink_mt>(lines));
  plant::PlantModel plant{plant::About{}};
  std::optional<AcknowledgementFile> sut;
};

TEST_F(AnAcknowledgementFile, IsEmptyAtFirst) {
  EXPECT_THAT(sut->load(), IsEmpty());
  EXPECT_EQ(lines.str(), "");
}

TEST_F(AnAcknowledgementFile, KeepsWhoWhenAndWhy) {
  acknowledge("held cnc/1", "fetching a \"new\" part, Maß 3");
  acknowledge("unserved 560aacbf", "");
  const auto kept = after_restart();
  ASSERT_THAT(kept, SizeIs(2));
  EXPECT_EQ(kept[0].first.cause, "held cnc/1");
  EXPECT_EQ(kept[0].first.note, "fetching a \"new\" part, Maß 3");
  plant::PlantModel next{plant::About{}};
  for (const auto& [acknowledgement, at] : kept) {
    next.acknowledge(acknowledgement, at);
  }
  EXPECT_EQ(next.acknowledged(), plant.acknowledged()) << "to the nanosecond";
  EXPECT_EQ(next.events(), plant.events());
}

TEST_F(AnAcknowledgementFile, KeepsWhatWasAcknowledgedAsAMessage) {
  const fabric::Message name =
      base::messages::about(base::messages::process_on_host("archiver", "hall", "7"), "Maß 3");
  plant.acknowledge({.cause = "alarm 7", .name = name, .by = "anna"},
                    fabric::Time(std::chrono::seconds(1)));
  sut->store(plant.acknowledged());
  acknowledge("held cnc/1", "");
  const auto kept = after_restart();
  ASSERT_THAT(kept, SizeIs(2));
  EXPECT_EQ(kept[0].first.name, name);
  EXPECT_EQ(kept[1].first.name, "cnc/1");
  EXPECT_EQ(kept[1].first.name.code, "");
}

TEST_F(AnAcknowledgementFile, ThatIsDamagedIsReportedAndSetAside) {
  for (const std::string text :
       {"[{\"cause\": \"un", "{}", "[1]", "[{\"cause\": \"held cnc/1\"}]",
        "[{\"cause\": \"x\", \"by\": \"anna\", \"time\": \"soon\"}]", ""}) {
    damage(text);
    lines.str("");
    EXPECT_THAT(after_restart(), IsEmpty()) << text;
    EXPECT_THAT(lines.str(), HasSubstr("acknowledged.json is damaged: ")) << text;
    EXPECT_THAT(lines.str(), HasSubstr("acknowledged.json.damaged")) << text;
    EXPECT_FALSE(fs::exists(file)) << text;
    EXPECT_TRUE(fs::exists(file.string() + ".damaged")) << text;
    acknowledge("held cnc/1", text);
    EXPECT_THAT(after_restart(), SizeIs(1)) << text;
  }
}

TEST_F(AnAcknowledgementFile, ThatIsFarTooLargeIsDamaged) {
  damage("[]");
  fs::resize_file(file, 4'000'001);
  EXPECT_THAT(after_restart(), IsEmpty());
  EXPECT_THAT(lines.str(), HasSubstr("it has 4000001 bytes"));
}

TEST_F(AnAcknowledgementFile, ThatCannotBeWrittenIsReported) {
  sut.reset();
  fs::create_directory(file);
  sut.emplace(folder.path() / "web", log);
  acknowledge("held cnc/1", "");
  EXPECT_THAT(lines.str(), HasSubstr("will be lost at the next restart"));
}

TEST_F(AnAcknowledgementFile, HasOneServer) {
  EXPECT_THAT([&] { AcknowledgementFile(folder.path() / "web", log); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("another millrace web")));
  std::ofstream(folder.path() / "a file") << "";
  EXPECT_THAT([&] { AcknowledgementFile(folder.path() / "a file", log); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("the folder cannot be made")));
}

}  // namespace
}  // namespace millrace::tools::web::live
