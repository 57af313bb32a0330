#include "services/archiver/segment.hpp"

#include <array>
#include <optional>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include "base/posix/files.hpp"
#include "base/text/cp1252.hpp"
#include "fabric/words.hpp"
#include "services/archiver/samples.hpp"

namespace millrace::services::archiver {

namespace {

using fabric::Time;

std::int64_t count(Time time) {
  return time.time_since_epoch().count();
}

constexpr const char* next_put_of =
    "SELECT max(coalesce((SELECT max(id) + 1 FROM put), 1), (SELECT first_put FROM archive))";

/// Also completes the interrupted begin of an earlier process.
void begin(SQLite::Database& database, const Beginning& beginning) {
  const bool has_puts = database.execAndGet("SELECT EXISTS (SELECT 1 FROM put)").getInt() != 0;
  const bool has_begun = database.execAndGet("SELECT EXISTS (SELECT 1 FROM archive)").getInt() != 0;
  if (has_begun && has_puts) {
    return;
  }
  SQLite::Statement set(
      database, has_begun
                    ? "UPDATE archive SET begun = min(begun, ?), first_put = max(first_put, ?)"
                    : "INSERT INTO archive (begun, first_put) VALUES (?, ?)");
  set.bind(1, count(beginning.begun));
  set.bind(2, beginning.first_put);
  set.exec();
}

/// Call it before any write.
void refuse_foreign(SQLite::Database& database) {
  if (database.execAndGet("PRAGMA user_version").getInt() == 0 &&
      database.execAndGet("SELECT EXISTS (SELECT 1 FROM sqlite_master)").getInt() != 0) {
    throw Foreign("a database, but not one of an archiver");
  }
}

template <typename Work>
auto naming_damage(Work work) {
  try {
    return work();
  } catch (const SQLite::Exception& error) {
    const int code = error.getErrorCode();
    if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) {
      throw Damaged(error.what());
    }
    throw;
  }
}

/// The same; a missing table means that the file is not ours.
template <typename Work>
auto naming_strangers(Work work) {
  try {
    return naming_damage(work);
  } catch (const SQLite::Exception& error) {
    if (error.getErrorCode() == SQLITE_ERROR) {
      throw Foreign(error.what());
    }
    throw;
  }
}

/// Finds a damaged page now, not during the write of a row that a call waits for.
void refuse_damaged(SQLite::Database& database) {
  const std::string found = database.execAndGet("PRAGMA quick_check(1)").getString();
  if (found != "ok") {
    throw Damaged(found);
  }
}

/// Opens the database for durable writing.
SQLite::Database open(const std::filesystem::path& file, const Beginning& beginning) {
  SQLite::Database database(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE,
                            busy_timeout_ms);
  refuse_foreign(database);
  refuse_newer(database);
  refuse_damaged(database);
  database.exec("PRAGMA journal_mode = WAL");
  // Each commit is on the disk when it returns: an acknowledged row survives a power cut.
  database.exec("PRAGMA synchronous = FULL");
  database.exec("PRAGMA foreign_keys = ON");
  migrate(database);
  begin(database, beginning);
  return database;
}

template <typename Value>
void bind(SQLite::Statement& statement, int index, const std::optional<Value>& value) {
  value ? statement.bind(index, *value) : statement.bind(index);
}

template <typename Value>
void bind(SQLite::Statement& statement, int index, const Value& value) {
  statement.bind(index, value);
}

/// Whether changes of a file are outside of it.
bool has_log(const std::filesystem::path& file) {
  std::error_code none;
  return std::filesystem::exists(file.string() + "-wal", none);
}

/// The identities of a file and of its write-ahead log, which has the newest changes.
using Identities = std::array<base::posix::FileIdentity, 2>;

Identities identities_of(const std::filesystem::path& file) {
  return {base::posix::identity_of(file), base::posix::identity_of(file.string() + "-wal")};
}

/// Binds `values` in their order and runs the statement; returns the number of changed rows.
template <typename... Values>
int run(SQLite::Statement& statement, const Values&... values) {
  // The plain reset() throws the error of the last execution once more.
  statement.tryReset();
  int index = 0;
  (bind(statement, ++index, values), ...);
  return statement.exec();
}

/// Columns of text have UTF-8; a text that is not UTF-8 has the controller's bytes.
std::string utf8(const std::string& text) {
  return base::text::is_utf8(text) ? text : base::text::to_utf8(text);
}

}  // namespace

/// Prepared once, used for every row.
struct Segment::Impl {
  Impl(const std::filesystem::path& path, const Beginning& beginning);

  /// The id of a put, 0 for the others.
  std::int64_t add(const Put& put);
  std::int64_t add(const EventRow& row);
  std::int64_t add(const fabric::ChannelStatus& status);
  std::int64_t add(const fabric::DataSample& sample);
  std::int64_t add(const fabric::ProgramEvent& event);
  std::int64_t id_of(const std::string& call);
  /// Call it after a failure. A statement that failed halfway, for example at another process's
  /// lock, keeps its snapshot of the database, and SQLite refuses writes on top of an old snapshot.
  void reset();

  std::filesystem::path file;
  SQLite::Database database;
  SQLite::Statement put;
  SQLite::Statement field;
  SQLite::Statement find;
  SQLite::Statement event;
  SQLite::Statement channel;
  SQLite::Statement program;
  Samples samples;
  std::int64_t next_put = 1;
  Identities opened;
};

Segment::Impl::Impl(const std::filesystem::path& path, const Beginning& beginning)
    : file(path),
      database(open(path, beginning)),
      put(database,
          "INSERT INTO put (id, call, at, machine, channel, state, text, replayed)"
          " VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (call) DO NOTHING"),
      field(database, "INSERT INTO field (put, key, value) VALUES (?, ?, ?)"),
      find(database, "SELECT id FROM put WHERE call = ?"),
      event(database,
            "INSERT INTO event (at, kind, machine, channel, call, attempt, instance, uuid, text,"
            " state, detail, replayed) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
      channel(database,
              "INSERT INTO channel (at, machine, channel, state, call, attempt, instance, uuid,"
              " reason) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING"),
      program(database,
              "INSERT INTO program (at, kind, machine, channel, program, started, error, parts,"
              " mode, detail, replayed) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
              " ON CONFLICT DO NOTHING"),
      samples(database),
      next_put(database.execAndGet(next_put_of).getInt64()),
      opened(identities_of(path)) {}

std::int64_t Segment::Impl::add(const Put& row) {
  const std::string call = row.call.to_string();
  const int added = run(put, next_put, call, count(row.at), row.key.machine,
                        std::int32_t{row.key.channel}, row.state, row.text, row.replayed ? 1 : 0);
  if (added == 0) {
    return id_of(call);
  }
  for (const Field& pair : row.fields) {
    run(field, next_put, pair.key, pair.value);
  }
  return next_put++;
}

std::int64_t Segment::Impl::add(const EventRow& row) {
  const fabric::Event& from = row.event;
  run(event, count(from.at), std::string(name_of(from.kind)), from.key.machine,
      std::int32_t{from.key.channel}, from.call.to_string(), from.attempt,
      from.instance.to_string(), utf8(from.uuid),
      row.with_text ? std::optional(base::text::to_utf8(from.text)) : std::nullopt, from.state,
      from.detail, from.replayed ? 1 : 0);
  return 0;
}

std::int64_t Segment::Impl::add(const fabric::ChannelStatus& row) {
  run(channel, count(row.since), row.key.machine, std::int32_t{row.key.channel},
      std::string(name_of(row.state)), row.call.to_string(), row.attempt, row.instance.to_string(),
      utf8(row.uuid), row.reason);
  return 0;
}

std::int64_t Segment::Impl::add(const fabric::DataSample& sample) {
  samples.add(sample);
  return 0;
}

std::int64_t Segment::Impl::add(const fabric::ProgramEvent& row) {
  const auto started =
      row.started == Time{} ? std::nullopt : std::optional<std::int64_t>(count(row.started));
  run(program, count(row.at), std::string(name_of(row.kind)), row.key.machine,
      std::int32_t{row.key.channel}, base::text::to_utf8(row.program), started, row.error,
      row.parts, row.mode, row.detail, row.replayed ? 1 : 0);
  return 0;
}

std::int64_t Segment::Impl::id_of(const std::string& call) {
  find.tryReset();
  find.bind(1, call);
  find.executeStep();
  const std::int64_t id = find.getColumn(0).getInt64();
  find.reset();
  return id;
}

void Segment::Impl::reset() {
  for (SQLite::Statement* const statement : {&put, &field, &find, &event, &channel, &program}) {
    statement->tryReset();
  }
  samples.forget();
}

Segment::Segment(const std::filesystem::path& file, const Beginning& beginning)
    : impl_(naming_strangers([&] { return std::make_unique<Impl>(file, beginning); })) {}
Segment::~Segment() {
  if (!impl_) {
    return;
  }
  const std::filesystem::path file = impl_->file;
  impl_.reset();
  if (has_log(file)) {
    return;  // Another process reads it, and its last reader merges the log.
  }
  try {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
    database.exec("PRAGMA journal_mode = DELETE");
  } catch (const std::exception&) {
    // It has all rows, but only those who may write into its folder can read it.
  }
}
Segment::Segment(Segment&&) noexcept = default;
Segment& Segment::operator=(Segment&&) noexcept = default;

std::vector<std::int64_t> Segment::append(const std::vector<Row>& rows) {
  if (identities_of(impl_->file) != impl_->opened) {
    // SQLite would continue to write to a file that has lost its name.
    throw std::runtime_error(
        "it was moved or removed while the archiver was using it; put it back, or restart the "
        "archiver");
  }
  const std::int64_t next_put = impl_->next_put;
  std::vector<std::int64_t> ids;
  ids.reserve(rows.size());
  try {
    naming_damage([&] {
      // The lock first: while another process has it, no statement begins.
      SQLite::Transaction transaction(impl_->database, SQLite::TransactionBehavior::IMMEDIATE);
      for (const Row& row : rows) {
        ids.push_back(std::visit([&](const auto& value) { return impl_->add(value); }, row));
      }
      transaction.commit();
    });
  } catch (...) {
    impl_->next_put = next_put;
    impl_->reset();
    throw;
  }
  return ids;
}

std::int64_t Segment::next_put() const {
  return impl_->next_put;
}

Time Segment::begun() const {
  return naming_damage([&] {
    const std::int64_t begun = impl_->database.execAndGet("SELECT begun FROM archive").getInt64();
    return Time(std::chrono::nanoseconds(begun));
  });
}

bool Segment::ended() const {
  return naming_damage([&] {
    return impl_->database.execAndGet("SELECT ended IS NOT NULL FROM archive").getInt() != 0;
  });
}

std::uintmax_t Segment::size() const {
  const auto number = [&](const char* pragma) {
    return static_cast<std::uintmax_t>(impl_->database.execAndGet(pragma).getInt64());
  };
  return number("PRAGMA page_count") * number("PRAGMA page_size");
}

bool close(const std::filesystem::path& file, Time now) {
  SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
  try {
    return naming_strangers([&] {
      SQLite::Statement update(database, "UPDATE archive SET ended = ? WHERE ended IS NULL");
      update.bind(1, count(now));
      update.exec();
      return database.execAndGet("PRAGMA journal_mode = DELETE").getString() == "delete";
    });
  } catch (const SQLite::Exception& error) {
    if (error.getErrorCode() == SQLITE_BUSY || error.getErrorCode() == SQLITE_LOCKED) {
      return false;
    }
    throw;
  }
}

SQLite::Database open_to_read(const std::filesystem::path& file) {
  try {
    SQLite::Database database(file.string(), SQLite::OPEN_READONLY, busy_timeout_ms);
    static_cast<void>(database.tableExists("archive"));
    return database;
  } catch (const SQLite::Exception& error) {
    const bool needs_log =
        error.getErrorCode() == SQLITE_CANTOPEN || error.getErrorCode() == SQLITE_READONLY;
    if (!needs_log || ::access(file.c_str(), R_OK) != 0 || has_log(file)) {
      throw;
    }
  }
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    uri += fmt::format("%{:02x}", static_cast<unsigned char>(c));
  }
  return {uri + "?immutable=1", SQLite::OPEN_READONLY | SQLite::OPEN_URI, busy_timeout_ms};
}

struct ClosedSegment::Impl {
  explicit Impl(const std::filesystem::path& file)
      // Writes nothing itself, but SQLite rolls back the rest of a crash, which needs write access.
      : database(file.string(), SQLite::OPEN_READWRITE, busy_timeout_ms),
        find(database, "SELECT id FROM put WHERE call = ?") {}

  SQLite::Database database;
  SQLite::Statement find;
};

ClosedSegment::ClosedSegment(const std::filesystem::path& file)
    : impl_(naming_strangers([&] { return std::make_unique<Impl>(file); })) {}
ClosedSegment::~ClosedSegment() = default;
ClosedSegment::ClosedSegment(ClosedSegment&&) noexcept = default;
ClosedSegment& ClosedSegment::operator=(ClosedSegment&&) noexcept = default;

std::optional<std::int64_t> ClosedSegment::find(fabric::CallId call) {
  return naming_strangers([&] {
    SQLite::Statement& find = impl_->find;
    find.tryReset();
    find.bind(1, call.to_string());
    const bool found = find.executeStep();
    const auto id = found ? std::optional(find.getColumn(0).getInt64()) : std::nullopt;
    find.reset();
    return id;
  });
}

std::int64_t ClosedSegment::next_put() const {
  return naming_strangers([&] { return impl_->database.execAndGet(next_put_of).getInt64(); });
}

std::optional<Time> ClosedSegment::ended() const {
  return naming_strangers([&] {
    SQLite::Statement ask(impl_->database, "SELECT ended FROM archive");
    const bool known = ask.executeStep() && !ask.getColumn(0).isNull();
    return known ? std::optional(Time(std::chrono::nanoseconds(ask.getColumn(0).getInt64())))
                 : std::nullopt;
  });
}

bool ClosedSegment::closed() const {
  return ended() && impl_->database.execAndGet("PRAGMA journal_mode").getString() == "delete";
}

}  // namespace millrace::services::archiver
