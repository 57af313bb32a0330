// Report files of #MSG SAVE: NC programs append lines to files in one folder
// (IB/tf5200_programming_manual/207171211, documented).
//
//   ReportFiles files("/var/lib/cnc");
//   files.append({"message.txt", "part 7 done", true, true}, std::chrono::system_clock::now());
//   → 2026-03-01 07:00:00.123 part 7 done
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "cnc/nc/event.hpp"

namespace millrace::cnc::simulator {

class ReportFiles {
 public:
  /// The format of the texts; the default is that of the example above.
  struct Form {
    /// A strftime format, with %f for milliseconds.
    std::string time = "%Y-%m-%d %H:%M:%S.%f ";
    /// Writes the text in quotation marks.
    bool quoted = false;
  };
  explicit ReportFiles(std::filesystem::path folder);
  ReportFiles(std::filesystem::path folder, Form form);

  /// Appends the text of the NC program unchanged, in CP1252, or returns why that failed. Refuses a
  /// file outside the folder, also through a link, and a name that begins with a dot (our choice).
  /// The time stamp is local time (our choice).
  tl::expected<void, std::string> append(const nc::SaveEvent& saved,
                                         std::chrono::system_clock::time_point now);

 private:
  std::filesystem::path folder_;
  Form form_;
};

}  // namespace millrace::cnc::simulator
