#include "tools/commands/replay/progress.hpp"

#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/print/units.hpp"

namespace millrace::tools::commands::replay {

Progress::Progress(std::size_t total, const char* what)
    : total_(total), what_(what), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::show(std::size_t done) {
  const auto now = Clock::now();
  if (!terminal_ || now < next_) {
    return;
  }
  next_ = now + std::chrono::milliseconds(200);
  drawn_ = true;
  if (total_ == 0) {
    fmt::print(stderr, "\r\033[K{} {}", done, what_);
    return;
  }
  constexpr std::size_t width = 40;
  const std::size_t filled = width * std::min(done, total_) / total_;
  std::string left = "…";
  if (done > 0) {
    const auto per_call = (now - start_) / static_cast<std::int64_t>(done);
    left =
        print::duration_text(per_call * static_cast<std::int64_t>(total_ - std::min(done, total_)));
  }
  fmt::print(stderr, "\r\033[K[{}{}] {} of {} {}, {} left", std::string(filled, '='),
             std::string(width - filled, ' '), done, total_, what_, left);
}

void Progress::clear() {
  if (drawn_) {
    fmt::print(stderr, "\r\033[K");
    drawn_ = false;
  }
}

}  // namespace millrace::tools::commands::replay
