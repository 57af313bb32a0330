#include "services/mail/compose.hpp"

#include <algorithm>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "services/mail/answering.hpp"
#include "services/mail/message.hpp"
#include "services/text/answer.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::mail {

namespace {

using sdk::Response;

template <typename Map>
std::string names_of(const Map& map) {
  std::string names;
  for (const auto& [name, value] : map) {
    names += (names.empty() ? "" : " ") + name;
  }
  return names;
}

/// All keys of a template that a request must contain.
std::set<std::string> wanted_keys(const MailTemplate& made) {
  std::set<std::string> keys;
  for (const Template* part : {&made.subject, &made.text}) {
    for (const std::string& key : part->keys()) {
      if (!key.starts_with(call_prefix)) {
        keys.insert(key);
      }
    }
  }
  return keys;
}

/// Adds each mailbox once, also if it is requested repeatedly or under different names.
void add(std::vector<Address>& to, const std::vector<Address>& more) {
  for (const Address& address : more) {
    if (std::ranges::find(to, address.mailbox, &Address::mailbox) == to.end()) {
      to.push_back(address);
    }
  }
}

tl::expected<std::vector<Address>, Response> recipients(const Config& config,
                                                        const Request& request,
                                                        const MailTemplate& made) {
  const auto& names = request.to.empty() ? made.to : request.to;
  if (names.empty()) {
    return tl::unexpected(
        text::error(state_unknown_recipient,
                    "template " + text::in_quotes(request.template_name) + " needs to=RECIPIENT"));
  }
  std::vector<Address> to;
  for (const std::string& name : names) {
    const auto found = config.recipients.find(name);
    if (found == config.recipients.end()) {
      return tl::unexpected(
          text::error(state_unknown_recipient,
                      fmt::format("unknown recipient {}; known are {}", text::in_quotes(name),
                                  names_of(config.recipients))));
    }
    add(to, found->second);
  }
  return to;
}

tl::expected<void, Response> check_keys(const Request& request, const MailTemplate& made) {
  const std::set<std::string> wanted = wanted_keys(made);
  for (const std::string& key : wanted) {
    if (!request.values.contains(key)) {
      return tl::unexpected(text::error(
          state_wrong_keys,
          fmt::format("template {} needs {}=...", text::in_quotes(request.template_name), key)));
    }
  }
  for (const auto& [key, value] : request.values) {
    if (!wanted.contains(key)) {
      return tl::unexpected(
          text::error(state_wrong_keys,
                      fmt::format("template {} has no placeholder for {}; it has {}",
                                  text::in_quotes(request.template_name), text::in_quotes(key),
                                  wanted.empty() ? std::string("none")
                                                 : fmt::format("{}", fmt::join(wanted, " ")))));
    }
  }
  return {};
}

void add_call_values(Values& values, const fabric::Request& call, fabric::Time now) {
  values["call.machine"] = call.key.machine;
  values["call.channel"] = std::to_string(call.key.channel);
  values["call.id"] = call.call.to_string();
  values["call.state"] = std::to_string(call.state);
  values["call.time"] = utc(now);
  values["call.request"] = base::text::to_utf8(call.text);
}

Mail make_mail(const Config& config, std::vector<Address> to, fabric::CallId id,
               std::string subject, std::string text, fabric::Time now) {
  Mail mail{.from = config.from.mailbox, .to = {}, .message = {}};
  for (const Address& address : to) {
    mail.to.push_back(address.mailbox);
  }
  mail.message = to_message({
      .from = config.from,
      .to = std::move(to),
      .date = now,
      .message_id = fmt::format("{}.millrace@{}", id.to_string(), domain_of(config.from)),
      .subject = std::move(subject),
      .text = std::move(text),
  });
  return mail;
}

}  // namespace

std::string utc(fabric::Time time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)));
}

const std::set<std::string>& call_keys() {
  static const std::set<std::string> keys{"call.machine", "call.channel", "call.id",
                                          "call.state",   "call.time",    "call.request"};
  return keys;
}

tl::expected<Mail, Response> compose(const Config& config, const fabric::Request& call,
                                     fabric::Time now) {
  auto request = parse(call.text);
  if (!request) {
    return tl::unexpected(text::error(text::state_bad_request, request.error()));
  }
  const auto found = config.templates.find(request->template_name);
  if (found == config.templates.end()) {
    return tl::unexpected(text::error(
        state_unknown_template,
        fmt::format("unknown template {}; known are {}", text::in_quotes(request->template_name),
                    names_of(config.templates))));
  }
  const MailTemplate& made = found->second;
  if (const auto keys = check_keys(*request, made); !keys) {
    return tl::unexpected(keys.error());
  }
  auto to = recipients(config, *request, made);
  if (!to) {
    return tl::unexpected(to.error());
  }
  Values values = std::move(request->values);
  add_call_values(values, call, now);
  return make_mail(config, *std::move(to), call.call, made.subject.fill(values).value(),
                   made.text.fill(values).value(), now);
}

Mail compose(const Config& config, const Rule& rule, const Values& values, fabric::CallId id,
             fabric::Time now) {
  std::vector<Address> to;
  for (const std::string& name : rule.to) {
    add(to, config.recipients.find(name)->second);
  }
  return make_mail(config, std::move(to), id, rule.subject.fill(values).value(),
                   rule.text.fill(values).value(), now);
}

namespace {

constexpr const char* to_key = "to";

tl::expected<std::vector<std::string>, std::string> names(std::string_view list) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t comma = std::min(list.find(',', at), list.size());
    const std::string_view name = list.substr(at, comma - at);
    if (!text::is_name(name)) {
      return tl::unexpected("no recipient can be called " + text::in_quotes(name));
    }
    names.emplace_back(name);
    at = comma + 1;
  }
  return names;
}

}  // namespace

tl::expected<Request, std::string> parse(std::string_view request) {
  const auto words = text::words(request);
  if (words.empty()) {
    return tl::unexpected(std::string("the request is empty; expected TEMPLATE key=value ..."));
  }
  const auto odd = std::find_if(request.begin(), request.end(),
                                [](char c) { return c != '\t' && !text::prints(c); });
  if (odd != request.end()) {
    return tl::unexpected(fmt::format("byte {} of the request (0x{:02X}) is not text",
                                      odd - request.begin() + 1, static_cast<unsigned char>(*odd)));
  }
  if (!text::is_name(words[0])) {
    return tl::unexpected("no template can be called " + text::in_quotes(words[0]));
  }
  Request parsed{.template_name = std::string(words[0]), .to = {}, .values = {}};
  auto fields = text::fields(
      request.substr(static_cast<std::size_t>(words[0].data() - request.data()) + words[0].size()));
  if (!fields) {
    return tl::unexpected(fields.error());
  }
  for (text::Field& field : *fields) {
    if (field.key == to_key) {
      auto to = names(field.value);
      if (!to) {
        return tl::unexpected(to.error());
      }
      parsed.to = *std::move(to);
    } else {
      parsed.values.emplace(std::move(field.key), base::text::to_utf8(field.value));
    }
  }
  return parsed;
}

}  // namespace millrace::services::mail
