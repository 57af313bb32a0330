#include "fabric/registry/identity_text.hpp"

#include <array>

#include <fmt/format.h>

#include "base/text/characters.hpp"
#include "base/text/number.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/words.hpp"

namespace millrace::fabric::registry {

namespace {

constexpr std::string_view header = "millrace-instance 2";
constexpr std::string_view instance_key = "instance=";

/// Far above what check_identity lets through: more is no identity of ours.
constexpr std::size_t max_text_size = std::size_t{64} * 1024;

using base::text::parse_number;
using Parsed = tl::expected<void, std::string>;

std::string escape(std::string_view value) {
  std::string text;
  for (const char c : value) {
    if (base::text::is_control(c) || c == '%') {
      text += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      text += c;
    }
  }
  return text;
}

std::optional<std::string> unescape(std::string_view text) {
  std::string value;
  while (!text.empty()) {
    if (text.front() != '%') {
      value += text.front();
      text.remove_prefix(1);
      continue;
    }
    const auto byte = parse_number<std::uint8_t>(text.substr(1, 2), 16);
    if (text.size() < 3 || !byte) {
      return std::nullopt;
    }
    value += static_cast<char>(*byte);
    text.remove_prefix(3);
  }
  return value;
}

/// Takes the part before the next `separator` off `rest`.
std::string_view take_until(std::string_view& rest, char separator) {
  const auto end = rest.find(separator);
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return part;
}

Parsed expect(bool met, std::string_view wanted) {
  return met ? Parsed{} : tl::unexpected(fmt::format("expected {}", wanted));
}

template <typename Number>
Parsed read_number(std::string_view value, Number& number) {
  const auto parsed = parse_number<Number>(value);
  number = parsed.value_or(0);
  return expect(parsed.has_value(), "a number");
}

Parsed read_id(std::string_view value, InstanceId& id) {
  const auto parsed = InstanceId::parse(value);
  id = parsed.value_or(InstanceId{});
  return expect(parsed.has_value(), "a UUID");
}

Parsed read_channels(std::string_view value, std::vector<ChannelScope>& channels) {
  while (!value.empty()) {
    auto scope = parse_channel_scope(take_until(value, ' '));
    if (!scope) {
      return tl::unexpected(std::move(scope.error()));
    }
    channels.push_back(std::move(*scope));
  }
  return {};
}

Parsed read_delivery(std::string_view value, Delivery& delivery) {
  const std::optional<Delivery> parsed = parse_delivery(value);
  delivery = parsed.value_or(Delivery::at_least_once);
  return expect(parsed.has_value(), "at-least-once or at-most-once");
}

Parsed read_awaited(std::string_view value, Awaited& awaited) {
  const std::optional<Awaited> parsed = parse_awaited(value);
  awaited = parsed.value_or(Awaited::response_state);
  return expect(parsed.has_value(), "response-state or response");
}

Parsed read_draining(std::string_view value, bool& draining) {
  draining = value == "yes";
  return expect(value == "yes" || value == "no", "yes or no");
}

Parsed read_value(std::string_view key, const std::string& value, InstanceIdentity& identity) {
  const std::array<std::pair<std::string_view, std::string*>, 5> texts{{
      {"uuid", &identity.uuid},
      {"name", &identity.name},
      {"description", &identity.description},
      {"version", &identity.version},
      {"host", &identity.host},
  }};
  for (const auto& [name, text] : texts) {
    if (key == name) {
      *text = value;
      return {};
    }
  }
  if (key == "id") {
    return read_id(value, identity.id);
  }
  if (key == "pid") {
    return read_number(value, identity.pid);
  }
  if (key == "concurrency") {
    return read_number(value, identity.concurrency);
  }
  if (key == "lease_ms") {
    std::uint32_t milliseconds = 0;
    auto read = read_number(value, milliseconds);
    identity.lease = std::chrono::milliseconds(milliseconds);
    return read;
  }
  if (key == "channels") {
    return read_channels(value, identity.channels);
  }
  if (key == "delivery") {
    return read_delivery(value, identity.delivery);
  }
  if (key == "awaited") {
    return read_awaited(value, identity.awaited);
  }
  if (key == "draining") {
    return read_draining(value, identity.draining);
  }
  return {};
}

Parsed read_line(std::string_view line, InstanceIdentity& identity) {
  const std::string_view key = line.substr(0, line.find('='));
  if (key.size() == line.size()) {
    return tl::unexpected(std::string("expected KEY=VALUE"));
  }
  const auto value = unescape(line.substr(key.size() + 1));
  if (!value) {
    return tl::unexpected(std::string("expected two hexadecimal digits after '%'"));
  }
  return read_value(key, *value, identity);
}

std::string join_channels(const std::vector<ChannelScope>& channels) {
  std::string text;
  for (const ChannelScope& scope : channels) {
    text += text.empty() ? "" : " ";
    text += format_channel_scope(scope);
  }
  return text;
}

}  // namespace

std::string format_identity(const InstanceIdentity& identity) {
  return fmt::format(
      "{}\nid={}\nuuid={}\nname={}\ndescription={}\nversion={}\nhost={}\npid={}\nchannels={}\n"
      "delivery={}\nawaited={}\nconcurrency={}\ndraining={}\nlease_ms={}\n",
      header, identity.id.to_string(), escape(identity.uuid), escape(identity.name),
      escape(identity.description), escape(identity.version), escape(identity.host), identity.pid,
      join_channels(identity.channels), name_of(identity.delivery), name_of(identity.awaited),
      identity.concurrency, identity.draining ? "yes" : "no", identity.lease.count());
}

tl::expected<InstanceIdentity, std::string> parse_identity(std::string_view text) {
  if (text.size() > max_text_size) {
    return tl::unexpected(
        fmt::format("identity of {} bytes, at most {}", text.size(), max_text_size));
  }
  if (take_until(text, '\n') != header) {
    return tl::unexpected(fmt::format("line 1: expected '{}'", header));
  }
  InstanceIdentity identity;
  for (int line = 2; !text.empty(); ++line) {
    if (auto read = read_line(take_until(text, '\n'), identity); !read) {
      return tl::unexpected(fmt::format("line {}: {}", line, read.error()));
    }
  }
  if (auto reason = check_identity(identity)) {
    return tl::unexpected(std::move(*reason));
  }
  return identity;
}

std::string format_instance(const InstanceId& id) {
  return fmt::format("{}{}", instance_key, id.to_string());
}

std::optional<InstanceId> parse_instance(std::string_view text) {
  if (!text.starts_with(instance_key)) {
    return std::nullopt;
  }
  return InstanceId::parse(text.substr(instance_key.size()));
}

}  // namespace millrace::fabric::registry
