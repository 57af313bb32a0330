// Any bytes as a request and a template: a mail has the headers and the recipients of the
// configuration and valid lines, and refusals have an answer that fits.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "services/mail/compose.hpp"
#include "services/mail/message.hpp"

using namespace millrace::services::mail;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

bool is_known(std::string_view line) {
  constexpr std::array<std::string_view, 9> headers{
      "Date: ",    "From: ",         "To: ",         "Message-ID: ",  "Subject: ",
      "MIME-Vers", "Auto-Submitted", "Content-Type", "Content-Transf"};
  for (const std::string_view header : headers) {
    if (line.starts_with(header)) {
      return true;
    }
  }
  return line.starts_with(' ');
}

void check_message(std::string_view message) {
  bool in_headers = true;
  std::size_t headers = 0;
  while (!message.empty()) {
    const std::size_t end = message.find("\r\n");
    require(end != std::string_view::npos);
    const std::string_view line = message.substr(0, end);
    require(line.size() <= 998);
    for (const char c : line) {
      require((c >= ' ' && c < 0x7F) || c == '\t');
    }
    in_headers = in_headers && !line.empty();
    require(!in_headers || is_known(line));
    headers += in_headers && !line.starts_with(' ') ? 1U : 0U;
    message.remove_prefix(end + 2);
  }
  require(headers == 9);
}

Config config(std::string_view text) {
  Config config;
  config.from = {"Press", "press@example.com"};
  config.recipients["shift"] = {{"", "eva@example.com"}};
  config.templates.insert_or_assign(
      "done", MailTemplate{.to = {"shift"},
                           .subject = Template::parse("{a} {call.request}").value(),
                           .text = Template::parse("{a}").value()});
  if (auto own = Template::parse(text)) {
    config.templates.insert_or_assign("own", MailTemplate{.to = {}, .subject = *own, .text = *own});
  }
  return config;
}

void check_request(const Config& config, const std::string& request) {
  const auto mail = compose(config, {.text = request}, {});
  if (mail) {
    require(!mail->to.empty());
    for (const std::string& to : mail->to) {
      require(to == "eva@example.com");
    }
    check_message(mail->message);
  } else {
    require(mail.error().state >= 10 && mail.error().state <= 13);
    require(mail.error().text.size() <= 127 && mail.error().text.starts_with("ERROR: "));
    require(mail.error().text.find('\0') == std::string::npos);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const Config made = config(bytes);
  check_request(made, bytes);
  check_request(made, "done a=" + bytes);
  check_request(made, "own to=shift " + bytes);
  // The builder alone is safe with any input, too.
  check_message(to_message({.from = {bytes, "press@example.com"},
                            .to = {{bytes, "eva@example.com"}},
                            .message_id = "1-1.millrace@example.com",
                            .subject = bytes,
                            .text = bytes}));
  return 0;
}
