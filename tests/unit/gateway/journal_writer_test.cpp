// When the journal is rewritten, and when entries are safe. The disk is a model: after a crash of
// the process it has what was written, after a power cut what was forced.
#include "gateway/journal/journal_writer.hpp"

#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/journal/format.hpp"

namespace millrace::gateway::journal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint64_t epoch = 7;

fabric::CallId call(std::uint64_t number) {
  return {epoch, number};
}

DispatchedEntry dispatched(std::uint64_t number) {
  DispatchedEntry entry;
  entry.call = call(number);
  entry.key = {"cnc", static_cast<std::uint16_t>(number)};
  return entry;
}

/// Executes its operations one by one on demand.
class ModelDisk final : public JournalFile {
 public:
  struct File {
    std::string bytes;
    std::size_t forced = 0;
  };

  tl::expected<void, std::string> begin(std::string_view bytes) override {
    file = {std::string(bytes), bytes.size()};
    return {};
  }
  tl::expected<void, std::string> append(std::string_view bytes) override {
    return append_to(file, bytes);
  }
  tl::expected<void, std::string> append_to_new_file(std::string_view bytes) override {
    return append_to(*new_file, bytes);
  }
  void start_force() override {
    start([this, upto = file.bytes.size()] {
      file.forced = upto;
      writer->on_forced(failure);
    });
  }
  void start_new_file(std::vector<JournalEntry> entries) override {
    ++new_files;
    start([this, bytes = encode_file(entries)] {
      new_file = File{bytes, 0};
      written_anew += bytes.size();
      if (failure.empty()) {
        writer->on_new_file(bytes.size());
      } else {
        writer->on_new_file(tl::unexpected(failure));
      }
    });
  }
  void start_replace() override {
    start([this, upto = new_file->bytes.size()] {
      new_file->forced = upto;
      start([this] {
        renamed = true;
        start([this] {
          if (failure.empty()) {
            file = *std::exchange(new_file, {});
            renamed = false;
          }
          writer->on_replaced(failure);
        });
      });
    });
  }
  void confirm(std::vector<Ticket> tickets) override {
    for (const Ticket& ticket : tickets) {
      (ticket.owner == Ticket::Owner::numbers ? recorded_numbers : recorded)
          .push_back(ticket.number);
    }
  }
  void report_error(const fabric::Message& error) override { errors.push_back(error); }

  /// One step of the present operation; false if there is none.
  bool step() {
    const auto next = std::exchange(under_way, {});
    if (next) {
      next();
    }
    return next != nullptr;
  }
  void finish() {
    while (step()) {
    }
  }

  /// What a new process finds if this one is killed now.
  [[nodiscard]] JournalState after_a_crash() const {
    return read(renamed ? new_file->bytes : file.bytes);
  }
  /// The same after a power cut: a changed name may lead to one file or the other.
  [[nodiscard]] std::vector<JournalState> after_a_power_cut() const {
    std::vector<JournalState> found{read(file.bytes.substr(0, file.forced))};
    if (renamed) {
      found.push_back(read(new_file->bytes.substr(0, new_file->forced)));
    }
    return found;
  }

  JournalWriter* writer = nullptr;
  File file;
  std::optional<File> new_file;
  bool renamed = false;
  bool full = false;
  /// The error of all later steps, if there is one.
  std::string failure;
  std::size_t new_files = 0;
  std::size_t appended = 0;
  std::size_t written_anew = 0;
  std::vector<std::string> errors;
  /// The numbers of calls, and of entries that reserve numbers.
  std::vector<std::uint64_t> recorded;
  std::vector<std::uint64_t> recorded_numbers;

 private:
  void start(std::function<void()> next) {
    EXPECT_FALSE(under_way) << "two things at once";
    under_way = std::move(next);
  }
  tl::expected<void, std::string> append_to(File& to, std::string_view bytes) {
    if (full) {
      to.bytes += bytes.substr(0, bytes.size() / 2);
      return tl::unexpected(std::string("is full"));
    }
    to.bytes += bytes;
    appended += bytes.size();
    return {};
  }
  static JournalState read(const std::string& bytes) {
    JournalState journal_state;
    for (const JournalEntry& entry : decode(bytes).entries) {
      journal_state.apply(entry);
    }
    return journal_state;
  }

  std::function<void()> under_way;
};

std::vector<std::uint64_t> open_in(const JournalState& journal_state) {
  std::vector<std::uint64_t> numbers;
  for (const CallRecord& record : journal_state.open_calls()) {
    numbers.push_back(record.id.number);
  }
  return numbers;
}

class JournalWriterTest : public testing::Test {
 protected:
  void open(Sync sync, std::size_t compact_at = 1024) {
    disk.writer =
        &sut.emplace(disk, FileOptions{.folder = {}, .sync = sync, .compact_at = compact_at});
    ASSERT_TRUE(sut->load("", epoch));
    ASSERT_TRUE(sut->begin());
  }
  void append(std::uint64_t number) {
    sut->append(dispatched(number), {.owner = Ticket::Owner::channel, .number = number});
  }
  void end(std::uint64_t number) { sut->append(EndedEntry{call(number)}, {}); }
  /// Calls that begin and end, until the file is longer than this.
  void fill(std::size_t bytes) {
    while (disk.file.bytes.size() <= bytes) {
      sut->append(dispatched(60'000), {});
      end(60'000);
    }
    disk.finish();
  }
  /// Each confirmed call is present.
  void expect_all_recorded(const JournalState& found, const std::string& where) {
    EXPECT_THAT(open_in(found), testing::IsSupersetOf(recorded)) << where;
  }

  ModelDisk disk;
  std::optional<JournalWriter> sut;
  std::vector<std::uint64_t>& recorded = disk.recorded;
};

TEST_F(JournalWriterTest, IsAsShortAsItCanBeAfterItsRewrite) {
  open(Sync::never);
  append(1);
  fill(1024);
  sut->on_tick();
  disk.finish();
  EXPECT_EQ(disk.file.bytes, encode_file(sut->state().snapshot()));
  EXPECT_EQ(disk.new_files, 1U);
}

TEST_F(JournalWriterTest, IsNotRewrittenRepeatedlyWhileManyCallsAreOpen) {
  open(Sync::interval);
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    append(number);
  }
  for (int tick = 0; tick < 100; ++tick) {
    sut->on_tick();
    disk.finish();
    append(1001);
    end(1001);
  }
  EXPECT_GT(disk.file.bytes.size(), 1024U);
  EXPECT_EQ(disk.new_files, 1U);
}

TEST_F(JournalWriterTest, RewritesInProportionToWhatWasAppended) {
  open(Sync::interval);
  constexpr std::uint64_t most = 5000;
  for (std::uint64_t number = 1; number <= 4 * most; ++number) {
    append(number % most);
    if (number > most / 2) {
      end((number - most / 2) % most);
    }
    sut->on_tick();
    disk.finish();
  }
  EXPECT_GT(disk.new_files, 5U);
  EXPECT_LE(disk.written_anew, 2 * disk.appended);
}

TEST_F(JournalWriterTest, ContinuesDuringItsRewrite) {
  open(Sync::interval);
  fill(1024);
  sut->on_tick();
  append(1);
  EXPECT_THAT(recorded, ElementsAre(1U)) << "while the draft is written";
  disk.step();
  append(2);
  EXPECT_THAT(recorded, ElementsAre(1U, 2U)) << "while the files are exchanged";
  disk.finish();
  EXPECT_THAT(open_in(disk.after_a_crash()), ElementsAre(1U, 2U));
}

TEST_F(JournalWriterTest, KeepsWhatItConfirmedWheneverTheProcessIsKilled) {
  for (const Sync sync : {Sync::never, Sync::interval, Sync::always}) {
    open(sync);
    recorded.clear();
    fill(1024);
    sut->on_tick();
    std::uint64_t number = 0;
    do {
      append(++number);
      expect_all_recorded(disk.after_a_crash(), "before step " + std::to_string(number));
    } while (disk.step() && number < 20);
    EXPECT_GT(number, 4U);
  }
}

TEST_F(JournalWriterTest, KeepsWhatItConfirmedWheneverThePowerFailsIfItForcesAlways) {
  open(Sync::always);
  fill(1024);
  sut->on_tick();
  for (std::uint64_t number = 1; number <= 20; ++number) {
    append(number);
    for (const JournalState& found : disk.after_a_power_cut()) {
      expect_all_recorded(found, "before step " + std::to_string(number));
    }
    disk.step();
  }
  disk.finish();
  EXPECT_EQ(recorded.size(), 20U);
  EXPECT_EQ(disk.new_files, 1U);
}

TEST_F(JournalWriterTest, IsRewrittenAlthoughForcesNeverEnd) {
  open(Sync::always);
  append(1);
  for (std::uint64_t number = 2; disk.new_files == 0 && number < 1000; ++number) {
    append(number);
    sut->on_tick();
    disk.step();
  }
  EXPECT_EQ(disk.new_files, 1U);
}

TEST_F(JournalWriterTest, ForcesCallNumbersUnderAnyPolicy) {
  open(Sync::never);
  sut->append(NumbersEntry{epoch, 1000}, {.owner = Ticket::Owner::numbers});
  append(1);
  EXPECT_THAT(recorded, ElementsAre(1U));
  EXPECT_THAT(disk.recorded_numbers, IsEmpty());
  disk.finish();
  EXPECT_EQ(disk.recorded_numbers.size(), 1U);
  EXPECT_EQ(disk.after_a_power_cut().front().numbers().reserved, 1000U);
}

TEST_F(JournalWriterTest, ConfirmsNothingWhileTheDiskIsFullAndAllWhenItIsNot) {
  open(Sync::interval);
  disk.full = true;
  append(1);
  EXPECT_THAT(disk.errors, ElementsAre("the journal is full; the gateway accepts no new call "
                                       "until the journal is writable"));
  append(2);
  disk.failure = "is full";
  sut->on_tick();
  disk.finish();
  EXPECT_THAT(recorded, IsEmpty());
  disk.full = false;
  disk.failure.clear();
  sut->on_tick();
  append(3);
  disk.finish();
  EXPECT_THAT(recorded, ElementsAre(1U, 2U, 3U));
  EXPECT_EQ(disk.errors.back(), "");
  EXPECT_THAT(open_in(disk.after_a_power_cut().front()), ElementsAre(1U, 2U, 3U));
}

TEST_F(JournalWriterTest, ReportsAnErrorUntilAllOfTheDraftIsWritten) {
  open(Sync::interval);
  fill(1024);
  sut->on_tick();
  disk.step();
  disk.full = true;
  append(1);
  disk.finish();
  EXPECT_THAT(recorded, IsEmpty());
  EXPECT_THAT(disk.errors.back(), HasSubstr("is full"));
  disk.full = false;
  sut->on_tick();
  disk.finish();
  EXPECT_THAT(recorded, ElementsAre(1U));
  EXPECT_EQ(disk.errors.back(), "");
}

TEST_F(JournalWriterTest, KeepsItsFileIfTheDraftCannotHoldNewEntries) {
  open(Sync::interval);
  fill(1024);
  sut->on_tick();
  append(1);
  ASSERT_THAT(recorded, ElementsAre(1U));
  disk.full = true;
  disk.finish();
  EXPECT_THAT(open_in(disk.after_a_crash()), ElementsAre(1U));
}

TEST_F(JournalWriterTest, TrustsNoFileAfterAForceThatFailed) {
  open(Sync::always);
  append(1);
  append(2);
  disk.failure = "cannot be forced";
  disk.finish();
  EXPECT_THAT(recorded, IsEmpty());
  EXPECT_THAT(disk.errors.back(), HasSubstr("cannot be forced"));
  disk.failure.clear();
  append(3);
  sut->on_tick();
  disk.finish();
  EXPECT_THAT(recorded, ElementsAre(1U, 2U, 3U));
  EXPECT_EQ(disk.new_files, 1U);
}

TEST_F(JournalWriterTest, KeepsItsFileAndTriesAgainWhenItCannotBeExchanged) {
  open(Sync::always);
  fill(1024);
  sut->on_tick();
  disk.step();
  append(1);
  disk.failure = "cannot be renamed";
  disk.finish();
  EXPECT_THAT(recorded, IsEmpty());
  disk.failure.clear();
  sut->on_tick();
  disk.finish();
  EXPECT_THAT(recorded, ElementsAre(1U));
  EXPECT_THAT(open_in(disk.after_a_power_cut().front()), ElementsAre(1U));
}

}  // namespace
}  // namespace millrace::gateway::journal
