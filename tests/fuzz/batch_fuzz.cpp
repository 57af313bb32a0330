// Any bytes as a request of a program and as its output: the argument is one string without a NUL,
// and the answer fits the CNC.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "services/batch/call.hpp"

using namespace millrace::services::batch;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

void check(const millrace::services::sdk::Response& answer) {
  require(answer.state != 0);
  require(answer.text.size() <= 127);
  require(answer.text.find('\0') == std::string::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) {
    return 0;
  }
  Script script;
  script.announcement.name = "program";
  script.accept_empty = (data[0] & 1U) != 0;
  script.encoding = (data[0] & 2U) != 0 ? Encoding::utf8 : Encoding::cp1252;
  script.too_long = (data[0] & 4U) != 0 ? TooLong::cut : TooLong::refuse;
  const std::string bytes(reinterpret_cast<const char*>(data + 2), size - 2);

  if (const auto command = command_for(script, {.text = bytes.substr(0, 127)})) {
    require(command->arguments.size() == 1);
    require(command->arguments[0].find('\0') == std::string::npos);
  } else {
    check(command.error());
  }
  const auto end = static_cast<End>(data[1] % 5);
  check(verdict(script, {.end = end,
                         .code = end == End::exited ? data[0] : data[0] % 65,
                         .output = {.text = bytes, .size = bytes.size()}})
            .answer);
  return 0;
}
