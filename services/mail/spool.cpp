#include "services/mail/spool.hpp"

#include <mutex>
#include <stdexcept>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "base/posix/files.hpp"
#include "base/posix/system.hpp"
#include "services/mail/spool_schema.hpp"

namespace millrace::services::mail {

namespace {

namespace fs = std::filesystem;

/// An operator may be reading the database with sqlite3.
constexpr int busy_timeout_ms = 5000;

constexpr const char* put_entry =
    "INSERT INTO mail (call, stage, made, next, attempts, reply, sender, recipients, message)"
    " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (call) DO UPDATE SET stage = excluded.stage,"
    " made = excluded.made, next = excluded.next, attempts = excluded.attempts,"
    " reply = excluded.reply, sender = excluded.sender, recipients = excluded.recipients,"
    " message = excluded.message";
/// An entry that an earlier start has imported may have changed since.
constexpr const char* find_entry =
    "SELECT call, stage, made, next, attempts, reply, sender, recipients, message FROM mail"
    " WHERE call = ?";

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
  void write(const char* statement, const Entry& entry);
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

void Spool::Impl::write(const char* statement, const Entry& entry) {
  SQLite::Statement query(database, statement);
  bind(query, entry);
  query.exec();
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
    open.bind(1, std::string(name_of(Stage::waiting)));
    open.bind(2, std::string(name_of(Stage::handed_over)));
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
  return impl_->guarded([&] { impl_->write(put_entry, entry); });
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
    query.bind(1, std::string(name_of(Stage::accepted)));
    query.bind(2, std::string(name_of(Stage::refused)));
    query.bind(3, static_cast<std::int64_t>(time.time_since_epoch().count()));
    query.exec();
  });
}

}  // namespace millrace::services::mail
