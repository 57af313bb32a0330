// Resource use of this process.
#pragma once

#include <optional>

namespace millrace::tools::web::live {

/// Each is nothing where the system does not report it.
struct ProcessUse {
  std::optional<double> cpu_seconds{};
  std::optional<double> resident_bytes{};
  std::optional<double> open_files{};
};

ProcessUse process_use();

}  // namespace millrace::tools::web::live
