// millrace-archiver as a process, called over the fabric, and killed.
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string uuid = "326de49a-633b-4cea-a9b8-1924d7f926a7";

class Archiver : public testing::Test {
 protected:
  Archiver() { std::ofstream(config) << "without_text: '" << secret_uuid << "'\n"; }

  Process start() {
    Process process({binary("millrace-archiver"), "--config", config.string(), "--domain",
                     std::to_string(domain.number())});
    process.await("^ready: ");
    return process;
  }
  /// The output of `query` or `export`.
  std::string show(std::vector<std::string> arguments) {
    std::vector<std::string> command{binary("millrace-archiver")};
    command.insert(command.end(), arguments.begin(), arguments.end());
    command.insert(command.end(), {"--config", config.string()});
    Process process(command);
    EXPECT_EQ(process.wait(), 0) << process.error_output();
    return process.output();
  }
  /// Waits until `query` of `kind` shows `text`.
  std::string await_row(const std::string& kind, const std::string& text) {
    return await_row(kind, text, caller);
  }
  std::string await_row(const std::string& kind, const std::string& text, Caller& publisher) {
    std::string rows;
    await("a row of " + kind + " with " + text, [&] {
      publisher.attend();
      rows = show({"export", "--format", "jsonl", "--kind", kind});
      return rows.find(text) != std::string::npos;
    });
    return rows;
  }

  const std::string secret_uuid = "fdeccc37-09ba-4ef6-bf20-2955ea738286";
  TemporaryFolder folder;
  std::filesystem::path config = folder.path() / "archiver.textproto";
  Domain domain;
  Caller caller{domain.number()};
};

TEST_F(Archiver, KeepsWhatProgramsPut) {
  const Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "PUT part=WELLE7 d=\"12.345 mm\"").text, "OK 1");
  EXPECT_EQ(caller.call(uuid, "tool 5 changed; Ma\xDF ok").text, "OK 2");
  EXPECT_EQ(caller.call(uuid, "PUT part").state, 10U);
  EXPECT_EQ(caller.call(uuid, "").state, 10U);
  EXPECT_EQ(caller.call(uuid, std::string(127, '\xFF')).text, "OK 3");

  EXPECT_THAT(show({"query", "--where", "part=WELLE7"}),
              AllOf(StartsWith("id\tat\tmachine\tchannel\tcall"), HasSubstr("12.345 mm")));
  EXPECT_THAT(show({"export", "--format", "csv"}), HasSubstr("tool 5 changed; Ma\xC3\x9F ok"));
}

TEST_F(Archiver, RecordsCallsAndChannelStates) {
  const Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  fabric::Event event{.key = {"cnc", 1},
                      .call = {.epoch = 9, .number = 1},
                      .kind = fabric::EventKind::written,
                      .at = fabric::Time(std::chrono::hours(1)),
                      .uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47",
                      .text = "2.0"};
  fabric::ChannelStatus status;
  status.key = {"cnc", 1};
  status.state = fabric::ChannelState::held;
  status.reason = "needs an operator";
  caller.publish(status);
  await_row("channel", "needs an operator");
  caller.publish(event);
  event.uuid = secret_uuid;
  event.text = "to the boss";
  event.detail = "second";
  caller.publish(event);
  const std::string rows = await_row("event", "second");
  EXPECT_THAT(rows, AllOf(HasSubstr("\"kind\":\"written\""), HasSubstr("\"text\":\"2.0\"")));
  EXPECT_THAT(rows, testing::Not(HasSubstr("boss")));
}

TEST_F(Archiver, UsesAConfigurationInItsWorkingFolder) {
  const std::vector<std::string> there{"/usr/bin/env", "-C", folder.path().string(),
                                       binary("millrace-archiver")};
  const auto in_folder = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), there.begin(), there.end());
    return Process(arguments);
  };
  Process sut =
      in_folder({"--config", "archiver.textproto", "--domain", std::to_string(domain.number())});
  sut.await("^ready: ");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "archive/archive-000001.db"));
  Process query = in_folder({"query", "--config", "archiver.textproto"});
  EXPECT_EQ(query.wait(), 0) << query.error_output();
}

TEST_F(Archiver, RecordsThatAChannelsGatewayIsGone) {
  const Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  {
    Caller gateway(domain.number());
    fabric::ChannelStatus status;
    status.key = {"press", 7};
    status.state = fabric::ChannelState::running;
    gateway.publish(status);
    await_row("channel", "running", gateway);
  }
  await_row("channel", "its gateway is gone");
}

TEST_F(Archiver, AnswersAgainAsSoonAsAnotherProcessReleasesItsLock) {
  const Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "PUT a=1").text, "OK 1");
  SQLite::Database other((folder.path() / "archive/archive-000001.db").string(),
                         SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  // The recorded event finds the file locked, too.
  caller.publish(fabric::Event{.key = {"cnc", 1},
                               .call = {.epoch = 9, .number = 1},
                               .kind = fabric::EventKind::written,
                               .at = fabric::Time(std::chrono::hours(1))});
  EXPECT_THAT(caller.call(uuid, "PUT a=2").text, HasSubstr("database is locked"));
  other.exec("DELETE FROM field");
  other.exec("COMMIT");
  // Continuous puts, without a second of pause.
  EXPECT_EQ(caller.call(uuid, "PUT a=3").text, "OK 2");
  await_row("event", "written");
}

TEST_F(Archiver, AcknowledgesNothingWithoutItsFolder) {
  const Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "PUT a=1").text, "OK 1");
  std::filesystem::rename(folder.path() / "archive", folder.path() / "yesterday");
  const fabric::Reply refused = caller.call(uuid, "PUT a=2");
  EXPECT_EQ(refused.state, 11U);
  EXPECT_THAT(refused.text, HasSubstr("it was moved or removed"));
  std::filesystem::rename(folder.path() / "yesterday", folder.path() / "archive");
  EXPECT_EQ(caller.call(uuid, "PUT a=2").text, "OK 2");
}

TEST_F(Archiver, KeepsADamagedFileAndAnswersFromTheNext) {
  const auto first = folder.path() / "archive/archive-000001.db";
  {
    const Process earlier = start();
    ASSERT_TRUE(caller.await_instance(uuid));
    const std::string text = "PUT a=\"" + std::string(110, 'x') + '"';
    for (int number = 1; number <= 300; ++number) {
      ASSERT_EQ(caller.call(uuid, text).text, "OK " + std::to_string(number));
    }
  }
  ASSERT_TRUE(caller.await_no_instance(uuid));
  SQLite::Database(first.string(), SQLite::OPEN_READWRITE).exec("PRAGMA wal_checkpoint(TRUNCATE)");
  const auto size = std::filesystem::file_size(first);
  std::fstream bytes(first, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(static_cast<std::streamoff>(size / 4));
  bytes << std::string(size / 2, 'x');
  bytes.close();
  Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_THAT(caller.call(uuid, "PUT a=2").text, StartsWith("OK "));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "archive/archive-000002.db"));
  sut.await_error("archive-000001.db is damaged");
}

/// Channels with continuous calls, which the next instance continues.
class Load {
 public:
  Load(Caller& caller, std::uint16_t channels) : caller_(caller) {
    for (std::uint16_t channel = 1; channel <= channels; ++channel) {
      pending_.push_back(next(channel));
    }
  }

  /// Sends all pending calls to the instance that is ready now.
  void begin() {
    for (fabric::Request& request : pending_) {
      request.assigned = caller_.identity(uuid).id;
      caller_.publish(request);
      ++request.attempt;
    }
  }

  /// Takes the answers and makes new calls.
  void run_once() {
    for (fabric::Request& request : pending_) {
      fabric::Reply reply;
      if (caller_.poll_reply(request, reply)) {
        EXPECT_THAT(reply.text, StartsWith("OK "));
        acknowledged.emplace(request.call.to_string(), reply.text.substr(3));
        request = next(request.key.channel);
        caller_.publish(request);
        ++request.attempt;
      }
    }
  }

  /// Call id and the id of its row.
  std::map<std::string, std::string> acknowledged;

 private:
  fabric::Request next(std::uint16_t channel) {
    return caller_.request(uuid, "PUT channel=" + std::to_string(channel), channel);
  }

  Caller& caller_;
  std::vector<fabric::Request> pending_;
};

/// Call id and row id of all puts.
std::multimap<std::string, std::string> rows_of(const std::string& csv) {
  std::multimap<std::string, std::string> rows;
  std::istringstream in(csv);
  std::string line;
  std::getline(in, line);  // the header
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',') && cells.size() < 5;) {
      cells.push_back(cell);
    }
    rows.emplace(cells.at(4), cells.at(0));
  }
  return rows;
}

TEST_F(Archiver, LosesNoAcknowledgedRowHoweverItIsKilled) {
  constexpr int crashes = 8;
  std::mt19937 random(20260301);
  std::optional<Load> load;
  for (int crash = 0; crash < crashes; ++crash) {
    Process sut = start();
    ASSERT_TRUE(caller.await_instance(uuid));
    if (!load) {
      load.emplace(caller, std::uint16_t{8});
    }
    load->begin();
    const std::size_t before = load->acknowledged.size();
    const std::size_t enough = 1 + random() % 60;
    while (load->acknowledged.size() < before + enough) {
      load->run_once();
    }
    // A moment within a transaction, an answer, or an idle time.
    const auto moment =
        std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 20'000);
    while (std::chrono::steady_clock::now() < moment) {
      load->run_once();
    }
    sut.kill();
    ASSERT_TRUE(caller.await_no_instance(uuid));
  }
  const auto rows = rows_of(show({"export", "--format", "csv"}));
  for (const auto& [call, id] : load->acknowledged) {
    ASSERT_EQ(rows.count(call), 1U) << call;
    EXPECT_EQ(rows.find(call)->second, id);
  }
  EXPECT_GE(load->acknowledged.size(), static_cast<std::size_t>(crashes));
}

TEST(ArchiverCommands, ExportFollowsNoLinkAtTheNameOfItsDraft) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "out.csv";
  const std::filesystem::path other = folder.path() / "other";
  std::ofstream(other) << "another's";
  std::filesystem::create_symlink(other, file.string() + ".part");
  std::filesystem::create_directory(folder.path() / "archive");
  Process sut({binary("millrace-archiver"), "export", "--format", "csv", "--folder",
               (folder.path() / "archive").string(), "--output", file.string()});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  std::string first;
  EXPECT_TRUE(std::ifstream(other) >> first);
  EXPECT_EQ(first, "another's");
  EXPECT_FALSE(std::filesystem::is_symlink(file));
}

TEST(ArchiverCommands, ExportLeavesItsFileAsItWasUnlessAllIsWell) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "out.csv").string();
  std::ofstream(file) << "yesterday's";
  for (const std::string since : {"yesterday", "1h"}) {
    Process sut({binary("millrace-archiver"), "export", "--format", "csv", "--folder",
                 (folder.path() / (since == "1h" ? "none" : ".")).string(), "--from", since,
                 "--output", file});
    EXPECT_EQ(sut.wait(), 2) << sut.error_output();
    std::string content;
    std::getline(std::ifstream(file), content);
    EXPECT_EQ(content, "yesterday's");
  }
  Process sut({binary("millrace-archiver"), "export", "--format", "csv", "--folder",
               folder.path().string(), "--output", file});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  std::string content;
  std::getline(std::ifstream(file), content);
  EXPECT_THAT(content, StartsWith("id,at,machine"));
  EXPECT_FALSE(std::filesystem::exists(file + ".part"));
}

TEST(ArchiverCommands, WriteNothingWhereNothingCanBeRead) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "archive-000001.db") << "no database";
  const std::string file = (folder.path() / "out.csv").string();
  std::ofstream(file) << "yesterday's";
  for (const std::vector<std::string>& output :
       {std::vector<std::string>{}, std::vector<std::string>{"--output", file}}) {
    std::vector<std::string> command{
        binary("millrace-archiver"), "export", "--format", "csv", "--folder",
        folder.path().string()};
    command.insert(command.end(), output.begin(), output.end());
    Process sut(command);
    EXPECT_EQ(sut.wait(), 1);
    EXPECT_EQ(sut.output(), "");
    EXPECT_THAT(sut.error_output(), HasSubstr("archive-000001.db: file is not a database"));
  }
  std::string content;
  std::getline(std::ifstream(file), content);
  EXPECT_EQ(content, "yesterday's");
  EXPECT_FALSE(std::filesystem::exists(file + ".part"));
}

TEST(ArchiverCommands, RefuseWrongArguments) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"query", "--folder", "/no/such/folder"},
        {"query", "--folder", folder.path().string(), "--from", "yesterday"},
        {"query", "--folder", folder.path().string(), "--kind", "event", "--where", "a"},
        {"export", "--folder", folder.path().string()}}) {
    std::vector<std::string> command{binary("millrace-archiver")};
    command.insert(command.end(), arguments.begin(), arguments.end());
    Process sut(command);
    EXPECT_EQ(sut.wait(), 2) << arguments.back() << sut.error_output();
  }
}

}  // namespace
}  // namespace millrace::tests
