// The waiting mails and the calls of sent mails: an SQLite database, spool.db in a folder.
//
//   Spool spool("/var/lib/millrace/mail/spool");
//   spool.put(entry);          // durable when it returns
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/mail.hpp"

namespace millrace::services::mail {

/// Functions may be called from any thread.
class Spool {
 public:
  template <typename Value>
  using Result = tl::expected<Value, std::string>;

  /// Creates a missing folder and database. Throws std::runtime_error if the folder cannot be used,
  /// if another process uses it, or if the database is damaged or not a spool.
  explicit Spool(std::filesystem::path folder);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;

  /// A summary without the mails.
  struct Content {
    std::size_t calls = 0;
    /// The calls with waiting mails, and the time of the next attempt of each.
    std::map<fabric::CallId, fabric::Time> waiting;
    /// The calls whose mails were handed over without a known reply.
    std::vector<fabric::CallId> in_doubt;
    /// When the last call came.
    std::optional<fabric::Time> last;
  };
  [[nodiscard]] Result<Content> content() const;
  [[nodiscard]] Result<std::optional<Entry>> find(fabric::CallId call) const;

  /// Each is one transaction: on failure nothing has changed, and the error contains file and
  /// reason.
  [[nodiscard]] Result<void> put(const Entry& entry);
  [[nodiscard]] Result<void> remove(fabric::CallId call);
  /// Removes finished calls from before `time` whose message is no longer stored.
  [[nodiscard]] Result<void> forget(fabric::Time time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::mail
