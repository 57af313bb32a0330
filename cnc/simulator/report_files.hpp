// What programs write with #MSG SAVE: lines appended to files in one folder
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
  /// How texts are written; by default as in the example above.
  struct Form {
    /// As strftime has it, and %f for milliseconds.
    std::string time = "%Y-%m-%d %H:%M:%S.%f ";
    /// In quotation marks.
    bool quoted = false;
  };
  explicit ReportFiles(std::filesystem::path folder);
  ReportFiles(std::filesystem::path folder, Form form);

  /// Appends what the program wrote, in CP1252 as it wrote it; the reason if that failed. A file
  /// outside the folder is refused, also by way of a link, and a name that begins with a dot (our
  /// choice). The time stamp is local time (our choice).
  tl::expected<void, std::string> append(const nc::SaveEvent& saved,
                                         std::chrono::system_clock::time_point now);

 private:
  std::filesystem::path folder_;
  Form form_;
};

}  // namespace millrace::cnc::simulator
