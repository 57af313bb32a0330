// A sentence as data: a code with arguments, and its English. Views translate by the code; logs,
// recordings and programs that do not know the code show the text.
//
//   Message reason = unknown_uuid(uuid);   // catalogue.hpp; too few arguments do not compile
//   reason.code                                      // "unknown_uuid"
//   reason.text                                      // "no service has the UUID 560a…"
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace millrace::base::messages {

/// Empty if there is nothing to say. It converts to its text, for code that only prints it.
struct Message {
  /// A word of the catalogue, at most 63 bytes; empty: the text is all there is, as that of an
  /// error of the operating system.
  std::string code{};
  /// What stands in the places of the sentence, in their order. Each may be a sentence itself.
  std::vector<Message> arguments{};
  /// In English, with its arguments.
  std::string text{};

  Message() = default;
  // NOLINTBEGIN(google-explicit-constructor,hicpp-explicit-conversions): a text is a message
  // without a code.
  Message(std::string of) : text(std::move(of)) {}
  Message(std::string_view of) : text(of) {}
  Message(const char* of) : text(of) {}
  operator const std::string&() const { return text; }
  operator std::string_view() const { return text; }
  // NOLINTEND(google-explicit-constructor,hicpp-explicit-conversions)

  [[nodiscard]] bool empty() const { return text.empty(); }
  void clear() { *this = {}; }
  /// Of two messages code and arguments count, too; beside a text the text alone.
  template <std::same_as<Message> Other>
  bool operator==(const Other& other) const {
    return text == other.text && code == other.code && arguments == other.arguments;
  }
  bool operator==(std::string_view other) const { return text == other; }
};

/// A message in the order in which it travels: each part is followed by its arguments.
struct MessagePart {
  std::string code{};
  /// How many of the following parts, with theirs, are arguments of this one.
  std::uint8_t arguments = 0;
  std::string text{};
  bool operator==(const MessagePart&) const = default;
};
/// None for an empty message.
std::vector<MessagePart> parts_of(const Message& message);
/// Of foreign parts: arguments that are missing, more than eight, or deeper than four are left out;
/// the text stays.
Message message_of(const std::vector<MessagePart>& parts);

}  // namespace millrace::base::messages
