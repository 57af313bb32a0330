#include "fabric/process_version.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"

namespace millrace::fabric {

namespace {

constexpr std::string_view header = "millrace-process 1";
constexpr std::size_t longest_version = 64;

/// Takes the next line off `rest`.
std::string_view take_line(std::string_view& rest) {
  const auto end = rest.find('\n');
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return line;
}

std::optional<std::string_view> after_key(std::string_view line, std::string_view key) {
  return line.starts_with(key) && line.substr(key.size()).starts_with('=')
             ? std::optional(line.substr(key.size() + 1))
             : std::nullopt;
}

}  // namespace

std::string format_process_version(const ProcessVersion& process) {
  return fmt::format("{}\nversion={}\nlowest_wire={}\nhighest_wire={}\n", header, process.version,
                     process.lowest_wire, process.highest_wire);
}

std::optional<ProcessVersion> parse_process_version(std::string_view user_data) {
  bool is_found = false;
  ProcessVersion process;
  while (!user_data.empty()) {
    const std::string_view line = take_line(user_data);
    if (!is_found) {
      is_found = line == header;
    } else if (const auto version = after_key(line, "version")) {
      process.version = version->substr(0, longest_version);
    } else if (const auto lowest = after_key(line, "lowest_wire")) {
      process.lowest_wire = base::text::parse_number<std::uint32_t>(*lowest).value_or(0);
    } else if (const auto highest = after_key(line, "highest_wire")) {
      process.highest_wire = base::text::parse_number<std::uint32_t>(*highest).value_or(0);
    }
  }
  return process.lowest_wire != 0 && process.lowest_wire <= process.highest_wire
             ? std::optional(std::move(process))
             : std::nullopt;
}

std::optional<std::uint32_t> wire_version_of(std::string_view topic) {
  constexpr std::array first{"millrace/request", "millrace/reply", "millrace/instance"};
  if (std::ranges::find(first, topic) != first.end()) {
    return 1;
  }
  constexpr std::string_view prefix = "millrace/v";
  if (!topic.starts_with(prefix)) {
    return std::nullopt;
  }
  topic.remove_prefix(prefix.size());
  return base::text::parse_number<std::uint32_t>(topic.substr(0, topic.find('/')));
}

bool is_too_old_for(const ProcessVersion& process, const ProcessVersion& other) {
  return process.highest_wire != 0 && process.highest_wire < other.lowest_wire;
}

std::string wire_text(const ProcessVersion& process) {
  const std::string range = process.lowest_wire == process.highest_wire
                                ? fmt::format("{}", process.lowest_wire)
                                : fmt::format("{}-{}", process.lowest_wire, process.highest_wire);
  return process.version.empty()
             ? range
             : fmt::format("{} (millrace {})", range, base::text::safe(process.version));
}

}  // namespace millrace::fabric
