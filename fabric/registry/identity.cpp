#include "fabric/registry/identity.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/shape.hpp"

namespace millrace::fabric::registry {

std::optional<std::string> check_identity(const InstanceIdentity& identity) {
  if (identity.id == InstanceId{}) {
    return "it has no instance id";
  }
  if (identity.uuid.empty() || identity.uuid.size() > max_text ||
      identity.uuid != canonical_uuid(identity.uuid)) {
    // A stranger's UUID may have 60 KiB.
    return fmt::format("its UUID {:?} is not in canonical form, 1 to {} bytes",
                       identity.uuid.substr(0, max_text), max_text);
  }
  // Partitions are patterns: with a wildcard an instance would get the requests of other UUIDs.
  if (std::any_of(identity.uuid.begin(), identity.uuid.end(),
                  [](char c) { return base::text::is_control(c) || c == '*' || c == '?'; })) {
    return fmt::format("its UUID {:?} contains a wildcard or a control character", identity.uuid);
  }
  for (const auto* value :
       {&identity.name, &identity.description, &identity.version, &identity.host}) {
    if (value->size() > max_identity_value) {
      return fmt::format("{:?}... is longer than {} bytes", value->substr(0, 20),
                         max_identity_value);
    }
  }
  if (identity.channels.size() > max_identity_channels) {
    return fmt::format("it names {} channels, at most {} fit", identity.channels.size(),
                       max_identity_channels);
  }
  if (identity.concurrency == 0) {
    return "its concurrency is 0";
  }
  for (const auto lease : {identity.lease, identity.busy_lease}) {
    if (lease != std::chrono::milliseconds(0) && lease < min_identity_lease) {
      return fmt::format("its lease of {} ms is shorter than {} ms", lease.count(),
                         min_identity_lease.count());
    }
  }
  return std::nullopt;
}

namespace {

constexpr std::string_view header = "millrace-instance 2";
constexpr std::string_view instance_key = "instance=";

/// Far above what check_identity lets through: more is not an identity of ours.
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

std::string_view word_of(const Leaf& leaf, std::uint8_t number) {
  constexpr std::array<std::string_view, 2> truth{"no", "yes"};
  if (leaf.kind == Kind::word) {
    return leaf.word(number);
  }
  return number < truth.size() ? truth.at(number) : "unknown";
}

/// The key of a field; empty if the identity does not announce it.
std::string key_of(const Leaf& leaf) {
  const std::string name(leaf.options.on_wire ? leaf.name : "");
  return leaf.kind == Kind::milliseconds ? name + "_ms" : name;
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

/// Sets the enumerator, or truth value, that `value` is the word of.
Parsed read_word(const Leaf& leaf, std::string_view value, void* member) {
  std::string words;
  for (std::uint8_t i = 0; !word_of(leaf, i).starts_with("unknown"); ++i) {
    if (word_of(leaf, i) == value) {
      set_number(leaf.kind, member, i);
      return {};
    }
    words += fmt::format("{}{}", words.empty() ? "" : " or ", word_of(leaf, i));
  }
  return tl::unexpected(fmt::format("expected {}", words));
}

Parsed read_value(const Leaf& leaf, const std::string& value, void* member) {
  switch (leaf.kind) {
    case Kind::text:
      as<std::string>(member) = value;
      return {};
    case Kind::list:
      return read_channels(value, as<std::vector<ChannelScope>>(member));
    case Kind::id: {
      const auto id = InstanceId::parse(value);
      as<InstanceId>(member) = id.value_or(InstanceId{});
      return id ? Parsed{} : tl::unexpected(std::string("expected a UUID"));
    }
    case Kind::boolean:
    case Kind::word:
      return read_word(leaf, value, member);
    default: {
      const auto number = parse_number<std::uint32_t>(value);
      set_number(leaf.kind, member, number.value_or(0));
      return number ? Parsed{} : tl::unexpected(std::string("expected a number"));
    }
  }
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
  for (const Leaf& leaf : shape_of<InstanceIdentity>()) {
    if (!key.empty() && key == key_of(leaf)) {
      return read_value(leaf, *value, leaf.member(&identity));
    }
  }
  return {};
}

std::string join_channels(const std::vector<ChannelScope>& channels) {
  std::string text;
  for (const ChannelScope& scope : channels) {
    text += text.empty() ? "" : " ";
    text += format_channel_scope(scope);
  }
  return text;
}

std::string text_of(const Leaf& leaf, const void* member) {
  switch (leaf.kind) {
    case Kind::text:
      return escape(as<std::string>(member));
    case Kind::list:
      return join_channels(as<std::vector<ChannelScope>>(member));
    case Kind::id:
      return as<InstanceId>(member).to_string();
    case Kind::boolean:
    case Kind::word:
      return std::string(word_of(leaf, static_cast<std::uint8_t>(number_of(leaf.kind, member))));
    default:
      return std::to_string(number_of(leaf.kind, member));
  }
}

}  // namespace

std::string format_identity(const InstanceIdentity& identity) {
  std::string text = fmt::format("{}\n", header);
  for (const Leaf& leaf : shape_of<InstanceIdentity>()) {
    if (const std::string key = key_of(leaf); !key.empty()) {
      text += fmt::format("{}={}\n", key, text_of(leaf, leaf.at(&identity)));
    }
  }
  return text;
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
