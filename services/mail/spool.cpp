#include "services/mail/spool.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <stdexcept>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "base/posix/files.hpp"
#include "base/posix/system.hpp"

namespace millrace::services::mail {

namespace {

namespace fs = std::filesystem;

/// The version that this process writes (PRAGMA user_version).
constexpr int schema_version = 1;

/// Times are nanoseconds since 1970-01-01T00:00:00Z, 0 = none. call is "EPOCH-NUMBER" as in logs,
/// recipients are one per line; the mail is empty once the server has accepted it.
constexpr const char* table = R"sql(
CREATE TABLE mail (
  call       TEXT    NOT NULL PRIMARY KEY,
  stage      TEXT    NOT NULL
             CHECK (stage IN ('waiting', 'handed over', 'accepted', 'refused', 'given up')),
  made       INTEGER NOT NULL,
  next       INTEGER NOT NULL,
  attempts   INTEGER NOT NULL,
  reply      TEXT    NOT NULL,
  sender     TEXT    NOT NULL,
  recipients TEXT    NOT NULL,
  message    TEXT    NOT NULL
) STRICT;
CREATE INDEX mail_stage ON mail (stage, made);
)sql";

/// In the order of Stage.
constexpr std::array<std::string_view, 5> stage_names{"waiting", "handed over", "accepted",
                                                      "refused", "given up"};

/// An operator may be reading the database with sqlite3.
constexpr int busy_timeout_ms = 5000;

constexpr const char* put_entry =
    "INSERT INTO mail (call, stage, made, next, attempts, reply, sender, recipients, message)"
    " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (call) DO UPDATE SET stage = excluded.stage,"
    " made = excluded.made, next = excluded.next, attempts = excluded.attempts,"
    " reply = excluded.reply, sender = excluded.sender, recipients = excluded.recipients,"
    " message = excluded.message";
constexpr const char* find_entry =
    "SELECT call, stage, made, next, attempts, reply, sender, recipients, message FROM mail"
    " WHERE call = ?";

std::int64_t count(fabric::Time time) {
  return time.time_since_epoch().count();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

/// The error text for a database that is damaged or not a spool.
std::string damage(const std::string& file, std::string_view why) {
  return fmt::format(
      "{}: damaged, or not the spool of a mail service: {}. It records which calls were sent: "
      "repair it (sqlite3 has .recover), or move it away; then earlier calls may be sent again",
      file, why);
}

/// Prepares an opened database for durable writing, with the current table.
void prepare(SQLite::Database& database) {
  const std::string& file = database.getFilename();
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (version > schema_version) {
    throw std::runtime_error(
        fmt::format("{}: written by a newer millrace (schema {}, this one knows up to {})", file,
                    version, schema_version));
  }
  if (version == 0 &&
      database.execAndGet("SELECT EXISTS (SELECT 1 FROM sqlite_master)").getInt() != 0) {
    throw std::runtime_error(damage(file, "it is the database of another program"));
  }
  if (const std::string state = database.execAndGet("PRAGMA quick_check(1)").getString();
      state != "ok") {
    throw std::runtime_error(damage(file, state));
  }
  database.exec("PRAGMA journal_mode = WAL");
  // Each commit is on the disk when it returns, so that a power cut does not send a mail twice.
  database.exec("PRAGMA synchronous = FULL");
  if (version == 0) {
    SQLite::Transaction transaction(database);
    database.exec(table);
    database.exec(fmt::format("PRAGMA user_version = {}", schema_version));
    transaction.commit();
  }
}

std::string name_of(Stage stage) {
  return std::string(stage_names.at(static_cast<std::size_t>(stage)));
}

fabric::Time time_of(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

fabric::CallId call_in(const std::string& text) {
  const auto call = fabric::parse_call_id(text);
  if (!call) {
    throw std::runtime_error(fmt::format("'{}' is not a call", text));
  }
  return *call;
}

/// Binds call, stage, made, next, attempts, reply, sender, recipients and message, in this order.
void bind(SQLite::Statement& statement, const Entry& entry) {
  int index = 0;
  statement.bind(++index, entry.call.to_string());
  statement.bind(++index, name_of(entry.stage));
  statement.bind(++index, count(entry.made));
  statement.bind(++index, count(entry.next));
  statement.bind(++index, entry.attempts);
  statement.bind(++index, entry.reply);
  statement.bind(++index, entry.mail.from);
  // Addresses have no line ends (message.cpp).
  statement.bind(++index, fmt::format("{}", fmt::join(entry.mail.to, "\n")));
  statement.bind(++index, entry.mail.message);
}

/// Reads the same columns; throws std::runtime_error if they are not a valid entry.
Entry entry_in(SQLite::Statement& row) {
  int index = 0;
  Entry entry{.call = call_in(row.getColumn(index).getString())};
  const std::string stage = row.getColumn(++index).getString();
  const auto* const known = std::ranges::find(stage_names, stage);
  if (known == stage_names.end()) {
    throw std::runtime_error(
        fmt::format("call {} has the stage '{}'", entry.call.to_string(), stage));
  }
  entry.stage = static_cast<Stage>(known - stage_names.begin());
  entry.made = time_of(row.getColumn(++index).getInt64());
  entry.next = time_of(row.getColumn(++index).getInt64());
  entry.attempts = row.getColumn(++index).getUInt();
  entry.reply = row.getColumn(++index).getString();
  entry.mail.from = row.getColumn(++index).getString();
  entry.mail.to = lines_of(row.getColumn(++index).getString());
  entry.mail.message = row.getColumn(++index).getString();
  return entry;
}

fs::path made(fs::path folder) {
  fs::create_directories(folder);
  return folder;
}

}  // namespace

struct Spool::Impl {
  explicit Impl(fs::path spool)
      : folder(made(std::move(spool))),
        lock(
            base::posix::lock_folder(folder, "spool.lock", "another mail service uses this spool")),
        file(folder / "spool.db"),
        database(open()),
        opened(base::posix::identity_of(file)) {}

  SQLite::Database open() const;
  /// Serializes the work, and checks that the file is the one that was opened; the error contains
  /// its name.
  template <typename Work>
  auto guarded(Work work) -> Result<decltype(work())>;

  fs::path folder;
  base::posix::Fd lock;
  fs::path file;
  std::mutex mutex;
  SQLite::Database database;
  base::posix::FileIdentity opened;
};

SQLite::Database Spool::Impl::open() const {
  try {
    SQLite::Database made(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE,
                          busy_timeout_ms);
    prepare(made);
    return made;
  } catch (const SQLite::Exception& error) {
    const int code = error.getErrorCode();
    if (code != SQLITE_NOTADB && code != SQLITE_CORRUPT && code != SQLITE_ERROR) {
      throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
    throw std::runtime_error(damage(file.string(), error.what()));
  }
}

template <typename Work>
auto Spool::Impl::guarded(Work work) -> Result<decltype(work())> {
  const std::lock_guard guard(mutex);
  if (base::posix::identity_of(file) != opened) {
    return tl::unexpected(
        file.string() +
        ": it was moved or removed while the service was using it; restart the service");
  }
  try {
    if constexpr (std::is_void_v<decltype(work())>) {
      work();
      return {};
    } else {
      return work();
    }
  } catch (const std::exception& error) {
    return tl::unexpected(fmt::format("{}: {}", file.string(), error.what()));
  }
}

Spool::Spool(fs::path folder) : impl_(std::make_unique<Impl>(std::move(folder))) {}
Spool::~Spool() = default;
Spool::Spool(Spool&& other) noexcept = default;

Spool::Result<Spool::Content> Spool::content() const {
  return impl_->guarded([&] {
    Content content;
    SQLite::Statement all(impl_->database, "SELECT count(*), max(made) FROM mail");
    all.executeStep();
    content.calls = static_cast<std::size_t>(all.getColumn(0).getInt64());
    if (!all.getColumn(1).isNull()) {
      content.last = time_of(all.getColumn(1).getInt64());
    }
    SQLite::Statement open(impl_->database,
                           "SELECT call, stage, next FROM mail WHERE stage IN (?, ?)");
    open.bind(1, name_of(Stage::waiting));
    open.bind(2, name_of(Stage::handed_over));
    while (open.executeStep()) {
      const fabric::CallId call = call_in(open.getColumn(0).getString());
      if (open.getColumn(1).getString() == name_of(Stage::waiting)) {
        content.waiting.emplace(call, time_of(open.getColumn(2).getInt64()));
      } else {
        content.in_doubt.push_back(call);
      }
    }
    return content;
  });
}

Spool::Result<std::optional<Entry>> Spool::find(fabric::CallId call) const {
  return impl_->guarded([&]() -> std::optional<Entry> {
    SQLite::Statement query(impl_->database, find_entry);
    query.bind(1, call.to_string());
    return query.executeStep() ? std::optional(entry_in(query)) : std::nullopt;
  });
}

Spool::Result<void> Spool::put(const Entry& entry) {
  return impl_->guarded([&] {
    SQLite::Statement query(impl_->database, put_entry);
    bind(query, entry);
    query.exec();
  });
}

Spool::Result<void> Spool::remove(fabric::CallId call) {
  return impl_->guarded([&] {
    SQLite::Statement query(impl_->database, "DELETE FROM mail WHERE call = ?");
    query.bind(1, call.to_string());
    query.exec();
  });
}

Spool::Result<void> Spool::forget(fabric::Time time) {
  return impl_->guarded([&] {
    // Keeps mails that an operator may want to read: those that were stored and then refused or
    // given up.
    SQLite::Statement query(
        impl_->database, "DELETE FROM mail WHERE stage IN (?, ?) AND message = '' AND made <= ?");
    query.bind(1, name_of(Stage::accepted));
    query.bind(2, name_of(Stage::refused));
    query.bind(3, count(time));
    query.exec();
  });
}

}  // namespace millrace::services::mail
