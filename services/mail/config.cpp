#include "services/mail/config.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "base/posix/fd.hpp"
#include "base/text/cp1252.hpp"
#include "idl/mail.pb.h"
#include "services/mail/compose.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::mail {

namespace {

namespace fs = std::filesystem;

/// Takes over what is good and collects mistakes, each with its place.
class Reader {
 public:
  Reader(const config::Mail& from, const fs::path& file)
      : from_(from), file_(file), folder_(fs::absolute(file).parent_path()) {}

  tl::expected<Config, std::string> read() {
    read_server();
    expect(!from_.from().empty(), "from", "is missing");
    take_address(from_.from(), "from", [&](Address address) { config_.from = std::move(address); });
    read_recipients();
    read_templates();
    read_retry();
    config_.spool = beside(from_.spool());
    config_.remember = std::chrono::hours(24) * from_.remember_days();
    config_.send_replayed = from_.send_replayed();
    if (!mistakes_.empty()) {
      return tl::unexpected(mistakes_);
    }
    return std::move(config_);
  }

 private:
  void expect(bool holds, const std::string& place, const std::string& mistake) {
    if (!holds) {
      mistakes_ +=
          fmt::format("{}{}: {} {}", mistakes_.empty() ? "" : "\n", file_.string(), place, mistake);
    }
  }

  [[nodiscard]] fs::path beside(const std::string& name) const {
    return (folder_ / name).lexically_normal();
  }

  template <typename Take>
  void take_address(const std::string& text, const std::string& place, Take take) {
    if (text.empty()) {
      return;
    }
    auto address = parse_address(text);
    expect(address.has_value(), place + ":", address ? "" : address.error());
    if (address) {
      take(*std::move(address));
    }
  }

  void read_server() {
    const config::Mail::Server& from = from_.server();
    const auto is_bad = [](char c) { return c <= ' ' || c == 0x7F; };
    const auto is_word = [&](const std::string& text) {
      return std::none_of(text.begin(), text.end(), is_bad);
    };
    expect(!from.host().empty() && is_word(from.host()), "server.host", "is missing or no name");
    expect(from.port() > 0 && from.port() <= std::numeric_limits<std::uint16_t>::max(),
           "server.port", "is not 1 to 65535");
    expect(is_word(from.hello()) && from.hello().find('/') == std::string::npos, "server.hello",
           "is no name");
    expect(from.connect_timeout_ms() > 0 && from.timeout_ms() > 0, "server",
           "has a time-out of 0; expected 1 ms or more");
    const bool file = !from.password_file().empty();
    const bool environment = !from.password_env().empty();
    expect(from.user().empty() ? !file && !environment : file != environment, "server",
           "needs password_file or password_env with user, and none without");
    expect(from.user().empty() || from.starttls() == config::Mail::REQUIRED, "server.user",
           "needs starttls: REQUIRED, or the password could be read on the way");
    config_.server = {.host = from.host(),
                      .port = static_cast<std::uint16_t>(from.port()),
                      .starttls = from.starttls() == config::Mail::REQUIRED,
                      .ca_file = from.ca_file().empty() ? fs::path() : beside(from.ca_file()),
                      .user = from.user(),
                      .password_file = file ? beside(from.password_file()) : fs::path(),
                      .password_env = from.password_env(),
                      .hello = from.hello(),
                      .connect_timeout = std::chrono::milliseconds(from.connect_timeout_ms()),
                      .timeout = std::chrono::milliseconds(from.timeout_ms())};
  }

  void read_recipients() {
    expect(from_.recipient_size() > 0, "recipient", "is missing; expected one or more");
    for (const auto& recipient : from_.recipient()) {
      const std::string place = "recipient '" + recipient.name() + "'";
      check_name(recipient.name(), place);
      expect(!config_.recipients.contains(recipient.name()), place, "is there twice");
      expect(recipient.address_size() > 0, place, "has no address");
      auto& addresses = config_.recipients[recipient.name()];
      for (const std::string& text : recipient.address()) {
        take_address(text, place,
                     [&](Address address) { addresses.push_back(std::move(address)); });
      }
    }
  }

  void read_templates() {
    expect(from_.template__size() > 0, "template", "is missing; expected one or more");
    for (const auto& from : from_.template_()) {
      const std::string place = "template '" + from.name() + "'";
      check_name(from.name(), place);
      expect(!config_.templates.contains(from.name()), place, "is there twice");
      expect(!from.subject().empty(), place, "has no subject");
      for (const std::string& name : from.to()) {
        expect(config_.recipients.contains(name), place,
               "is to '" + name + "', who is no recipient");
      }
      const auto line_end = [](char c) { return c == '\n' || c == '\r'; };
      expect(std::none_of(from.subject().begin(), from.subject().end(), line_end), place,
             "has a subject of more than one line");
      auto subject = text_of(from.subject(), place + ", subject:");
      auto text = text_of(from.text(), place + ", text:");
      if (subject && text) {
        config_.templates.insert_or_assign(from.name(),
                                           MailTemplate{.to = {from.to().begin(), from.to().end()},
                                                        .subject = *std::move(subject),
                                                        .text = *std::move(text)});
      }
    }
  }

  void check_name(const std::string& name, const std::string& place) {
    expect(text::is_name(name), place, "has no name of 1 to 32 letters, digits, '_' or '-'");
  }

  std::optional<Template> text_of(const std::string& text, const std::string& place) {
    expect(base::text::is_utf8(text), place, "is not UTF-8");
    auto parsed = Template::parse(text);
    expect(parsed.has_value(), place, parsed ? "" : parsed.error());
    if (!parsed) {
      return std::nullopt;
    }
    const std::set<std::string>& known = call_keys();
    for (const std::string& key : parsed->keys()) {
      expect(!key.starts_with(call_prefix) || known.contains(key), place,
             fmt::format("there is no {{{}}}; there is {}", key, fmt::join(known, " ")));
      expect(key != "to", place, "{to} names recipients in requests; choose another key");
    }
    return *std::move(parsed);
  }

  void read_retry() {
    const config::Mail::Retry& from = from_.retry();
    expect(from.first_ms() > 0 && from.longest_ms() >= from.first_ms(), "retry",
           "needs first_ms of 1 or more, and longest_ms not below it");
    expect(from.give_up_hours() > 0, "retry.give_up_hours", "is 0; expected 1 or more");
    config_.retry = {.first = std::chrono::milliseconds(from.first_ms()),
                     .longest = std::chrono::milliseconds(from.longest_ms()),
                     .give_up = std::chrono::hours(from.give_up_hours())};
  }

  const config::Mail& from_;
  fs::path file_;
  fs::path folder_;
  Config config_;
  std::string mistakes_;
};

tl::expected<std::string, std::string> first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line)) {
    return tl::unexpected(base::posix::last_error("cannot read the password in " + file.string()));
  }
  if (line.ends_with('\r')) {
    line.pop_back();
  }
  return line;
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  return base::configuration::read_config<config::Mail>(file).and_then(
      [&](const config::Mail& from) { return Reader(from, file).read(); });
}

tl::expected<std::string, std::string> password(const ServerConfig& server) {
  if (server.user.empty()) {
    return std::string();
  }
  if (!server.password_file.empty()) {
    return first_line(server.password_file);
  }
  const char* const value = std::getenv(server.password_env.c_str());
  if (value == nullptr) {
    return tl::unexpected("the environment has no " + server.password_env +
                          ", which password_env names");
  }
  return std::string(value);
}

}  // namespace millrace::services::mail
