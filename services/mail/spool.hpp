// The folder of the mails that wait, and of the calls that were sent: one file each.
//
//   Spool spool("/var/lib/millrace/mail/spool");
//   spool.put(entry);          // durable when it returns
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "base/posix/fd.hpp"
#include "services/mail/mail.hpp"

namespace millrace::services::mail {

/// Not thread-safe, but for different calls.
class Spool {
 public:
  /// Makes the folder if it is not there. Throws std::runtime_error if it cannot be used, or if
  /// another process does.
  explicit Spool(std::filesystem::path folder);

  struct Content {
    std::vector<Entry> entries;
    /// One line for each file that cannot be read. Its call is among the entries as handed over:
    /// it may have been sent.
    std::vector<std::string> mistakes;
  };
  [[nodiscard]] Content read() const;

  /// The old file is there whole or the new one is. The error names the step and the reason.
  [[nodiscard]] tl::expected<void, std::string> put(const Entry& entry) const;
  [[nodiscard]] tl::expected<void, std::string> remove(fabric::CallId call) const;

 private:
  std::filesystem::path folder_;
  base::posix::Fd lock_;
};

}  // namespace millrace::services::mail
