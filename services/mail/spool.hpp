// The mails that wait, and the calls that were sent: an SQLite database, spool.db in a folder.
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

  /// Makes folder and database if they are not there, and takes over what an earlier version left
  /// as a file for each call. Throws std::runtime_error if the folder cannot be used, if another
  /// process uses it, or if the database is damaged or somebody else's.
  explicit Spool(std::filesystem::path folder);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;

  /// A line for each file of an earlier version that could not be read. Its call is in the spool as
  /// handed over: it may have been sent. The file has ".broken" behind its name now.
  [[nodiscard]] const std::vector<std::string>& mistakes() const;

  /// What there is, without the mails.
  struct Content {
    std::size_t calls = 0;
    /// The calls whose mails wait, and when each is to be tried again.
    std::map<fabric::CallId, fabric::Time> waiting;
    /// The calls whose mails were handed over, and no answer is known.
    std::vector<fabric::CallId> in_doubt;
    /// When the last call came.
    std::optional<fabric::Time> last;
  };
  [[nodiscard]] Result<Content> content() const;
  [[nodiscard]] Result<std::optional<Entry>> find(fabric::CallId call) const;

  /// Each is one transaction: what was there stays if it fails, and the error names file and
  /// reason.
  [[nodiscard]] Result<void> put(const Entry& entry);
  [[nodiscard]] Result<void> remove(fabric::CallId call);
  /// Calls from before `time` that are done and of which nobody needs to see the message.
  [[nodiscard]] Result<void> forget(fabric::Time time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::mail
