#include "services/batch/call.hpp"

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "fabric/messages.hpp"

namespace millrace::services::batch {

namespace {

using sdk::Response;
using text::error;

/// In bytes: enough to recognise 127 characters of up to 3 bytes and the text after them.
constexpr std::size_t max_kept = 4096;

std::string without_line_ends(std::string text) {
  const std::size_t last = text.find_last_not_of("\r\n");
  text.resize(last == std::string::npos ? 0 : last + 1);
  return text;
}

std::string to_program(const Script& script, const std::string& request) {
  return script.encoding == Encoding::utf8 ? base::text::to_utf8(request) : request;
}

std::uint32_t state_of(const Ended& ended) {
  const auto code = static_cast<std::uint32_t>(ended.code);
  if (ended.end == End::signalled) {
    return state_signal + code;
  }
  return code == 0 ? text::state_ok : state_exit_code + code;
}

Response refused(const Script& script, const std::string& why) {
  return error(state_output_refused,
               fmt::format("output of {}: {}", script.announcement.name, why));
}

/// Removes half a character where the UTF-8 output was truncated.
std::string whole_characters(std::string text) {
  while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80U) {
    text.pop_back();
  }
  if (!text.empty() && static_cast<unsigned char>(text.back()) >= 0xC0U) {
    text.pop_back();
  }
  return text;
}

tl::expected<std::string, std::string> output_text(const Script& script, const Captured& output) {
  std::string text = without_line_ends(output.text);
  if (script.encoding == Encoding::cp1252) {
    return text;
  }
  if (output.size > output.text.size()) {
    text = whole_characters(std::move(text));
  }
  return base::text::to_cp1252(text);
}

/// The response for a process without output: how it ended.
Response silent_answer(const Script& script, const Ended& ended) {
  const std::string& name = script.announcement.name;
  const std::uint32_t state = state_of(ended);
  if (ended.end == End::signalled) {
    return error(state, fmt::format("{} was ended by signal {}", name, ended.code));
  }
  return ended.code == 0 ? Response{}
                         : error(state, fmt::format("{} ended with code {}", name, ended.code));
}

Verdict output_verdict(const Script& script, const Ended& ended) {
  auto text = output_text(script, ended.output);
  if (!text) {
    return {refused(script, text.error())};
  }
  if (text->find('\0') != std::string::npos) {
    return {refused(script, "holds a NUL byte")};
  }
  if (text->empty()) {
    return {silent_answer(script, ended)};
  }
  if (text->size() <= fabric::max_text) {
    return {{.text = std::move(*text), .state = state_of(ended)}};
  }
  const std::string size = fmt::format("{} bytes", ended.output.size);
  if (script.too_long == TooLong::refuse) {
    return {refused(script, size + ", at most 127 fit")};
  }
  text->resize(fabric::max_text);
  return {{.text = std::move(*text), .state = state_of(ended)}, size + " of output, cut to 127"};
}

Verdict unfinished_verdict(const Script& script, const Ended& ended) {
  const std::string& name = script.announcement.name;
  switch (ended.end) {
    case End::time_limit:
      return {error(state_time_limit,
                    fmt::format("{} took longer than {} ms", name, script.time_limit.count()))};
    case End::unwanted:
      return {error(state_withdrawn, name + " was ended: the call was cancelled")};
    default:
      return {error(state_not_started, name + " cannot be started: " + ended.reason)};
  }
}

}  // namespace

tl::expected<Command, Response> command_for(const Script& script, const fabric::Request& call) {
  if (call.text.empty() && !script.accept_empty) {
    return tl::unexpected(error(text::state_bad_request, "the request is empty"));
  }
  if (call.text.find('\0') != std::string::npos) {
    return tl::unexpected(error(text::state_bad_request, "the request holds a NUL byte"));
  }
  const std::string request = to_program(script, call.text);
  Command command{.program = script.program,
                  .arguments = script.arguments,
                  .environment = {"MILLRACE_CALL=" + call.call.to_string(),
                                  fmt::format("MILLRACE_ATTEMPT={}", call.attempt),
                                  "MILLRACE_MACHINE=" + call.key.machine,
                                  fmt::format("MILLRACE_CHANNEL={}", call.key.channel),
                                  fmt::format("MILLRACE_STATE={}", call.state),
                                  fmt::format("MILLRACE_REPLAYED={}", call.replayed ? 1 : 0)},
                  .folder = script.folder,
                  .input = request + '\n'};
  command.arguments.push_back(request);
  return command;
}

Limits limits_for(const Script& script) {
  return {.time_limit = script.time_limit, .max_output = max_kept, .max_errors = max_kept};
}

Verdict verdict(const Script& script, const Ended& ended) {
  const bool finished = ended.end == End::exited || ended.end == End::signalled;
  Verdict verdict = finished ? output_verdict(script, ended) : unfinished_verdict(script, ended);
  const std::string errors = without_line_ends(ended.errors.text);
  if (!errors.empty()) {
    verdict.remark += (verdict.remark.empty() ? "says: " : "; says: ") + errors;
  }
  return verdict;
}

}  // namespace millrace::services::batch
