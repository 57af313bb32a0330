#include "fabric/dds/cyclone_log.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <mutex>

#include <dds/dds.h>

#include "base/program/barrier.hpp"
#include "base/program/repeats.hpp"

namespace millrace::fabric::dds {

namespace {

struct Log {
  std::mutex lock;
  base::program::Repeats repeats;
};

/// Never destroyed: Cyclone's threads may log until the end of the process.
Log& log() {
  static Log& only = *new Log;
  return only;
}

/// Cyclone deletes a participant with an expired certificate itself, and does not find it when it
/// is deleted here.
constexpr std::string_view deleted_already = "dds_participant_delete: internal error -3";

void write(void*, const dds_log_data_t* data) noexcept {
  base::program::contain("writing the log of Cyclone DDS", [&] {
    const std::string_view header(data->message - data->hdrsize, data->hdrsize);
    const std::string text(data->message, data->size);
    if (text.starts_with(deleted_already)) {
      return;
    }
    const std::lock_guard guard(log().lock);
    if (const auto line =
            log().repeats.note(kind_of_line(text), text, std::chrono::steady_clock::now())) {
      const std::string whole = std::string(header) + *line + '\n';
      std::fwrite(whole.data(), 1, whole.size(), stderr);
    }
  });
}

}  // namespace

std::string kind_of_line(std::string_view text) {
  std::string kind;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    const bool has_digit =
        std::any_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
    kind += has_digit ? std::string_view("#") : word;
    kind += ' ';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return kind;
}

void take_cyclone_log() {
  dds_set_log_sink(&write, nullptr);
}

}  // namespace millrace::fabric::dds
