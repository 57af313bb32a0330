#include "base/messages/message.hpp"

namespace millrace::base::messages {

namespace {

constexpr std::size_t most_arguments = 8;
constexpr int deepest = 4;

void add_parts(const Message& message, std::vector<MessagePart>& parts) {
  parts.push_back(
      {message.code, static_cast<std::uint8_t>(message.arguments.size()), message.text});
  for (const Message& argument : message.arguments) {
    add_parts(argument, parts);
  }
}

/// Takes one part and its arguments from `next` on.
Message take(const std::vector<MessagePart>& parts, std::size_t& next, int depth) {
  const MessagePart& part = parts[next++];
  Message message;
  message.code = part.code;
  message.text = part.text;
  for (std::size_t i = 0; i < part.arguments && next < parts.size() && depth < deepest; ++i) {
    Message argument = take(parts, next, depth + 1);
    if (message.arguments.size() < most_arguments) {
      message.arguments.push_back(std::move(argument));
    }
  }
  return message;
}

}  // namespace

std::vector<MessagePart> parts_of(const Message& message) {
  std::vector<MessagePart> parts;
  if (!message.code.empty() || !message.text.empty()) {
    add_parts(message, parts);
  }
  return parts;
}

Message message_of(const std::vector<MessagePart>& parts) {
  std::size_t next = 0;
  return parts.empty() ? Message() : take(parts, next, 0);
}

}  // namespace millrace::base::messages
