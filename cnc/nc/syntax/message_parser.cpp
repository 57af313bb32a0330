#include <array>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/parsers.hpp"
#include "cnc/nc/values/format.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr std::array<std::string_view, 5> receivers = {"ISG_DIAG_BED", "DIAG", "HMI", "PLC",
                                                       "EVENT_LOGGER"};
constexpr std::size_t most_values = 20;

void check_format(Cursor& cursor, const Token& token, const FormattedText& text) {
  const auto pieces = values::parse_format(text.format);
  if (!pieces) {
    cursor.fail_at(token, pieces.error().text, pieces.error().id);
  } else if (values::conversions(*pieces) != text.values.size()) {
    cursor.fail_at(token,
                   "the text has " + std::to_string(values::conversions(*pieces)) +
                       " conversions (%d %u %f %s) but " + std::to_string(text.values.size()) +
                       " values follow",
                   20721);
  }
}

// ["text", value, …]
FormattedText parse_formatted_text(Cursor& cursor) {
  FormattedText text;
  cursor.expect("[");
  const Token token = cursor.peek();
  if (token.kind != TokenKind::string) {
    cursor.fail("a text in quotation marks expected before " + describe(token));
    return text;
  }
  text.format = unquote(cursor.take().text);
  while (cursor.accept(",")) {
    if (cursor.peek().is("]") || cursor.at_block_end()) {
      cursor.fail("a value expected behind the comma", 20726);
    } else if (text.values.size() == most_values) {
      cursor.fail("a message takes at most " + std::to_string(most_values) + " values", 20724);
    } else {
      text.values.push_back(parse_expression(cursor));
    }
  }
  cursor.expect("]");
  if (!cursor.failed()) {
    check_format(cursor, token, text);
  }
  return text;
}

// SYN, SYN_ACK (or SYN ACK, as the vendor's editor) or ACK
void parse_mode(Cursor& cursor, Message& message) {
  if (cursor.accept_word("SYN")) {
    message.synchronous = true;
    message.acknowledge = cursor.accept_word("ACK");
  } else if (cursor.accept_word("SYN_ACK")) {
    message.synchronous = true;
    message.acknowledge = true;
  } else if (cursor.accept_word("ACK")) {
    message.acknowledge = true;
  }
}

void parse_receiver(Cursor& cursor, Message& message) {
  message.receiver = receivers.front();
  for (const std::string_view receiver : receivers) {
    if (cursor.accept_word(receiver)) {
      message.receiver = receiver;
    }
  }
}

Statement parse_save(Cursor& cursor) {
  SaveMessage save;
  save.time_stamp = !cursor.accept_word("EXCLUSIVE");
  save.line_end = !cursor.accept_word("CONTINUE");
  if (cursor.peek().kind == TokenKind::name) {
    cursor.fail("#MSG SAVE takes only EXCLUSIVE and CONTINUE, no mode and no receiver");
  }
  save.text = parse_formatted_text(cursor);
  return save;
}

}  // namespace

Statement parse_message(Cursor& cursor) {
  if (cursor.accept_word("SAVE")) {
    return parse_save(cursor);
  }
  Message message;
  message.info = cursor.accept_word("INFO");
  parse_mode(cursor, message);
  parse_receiver(cursor, message);
  if (cursor.peek().kind == TokenKind::name) {
    cursor.fail_unknown(
        "unknown mode or receiver " + describe(cursor.peek()) +
        "; modes are SYN, SYN_ACK and ACK, receivers ISG_DIAG_BED, DIAG, HMI, PLC and "
        "EVENT_LOGGER");
  }
  message.text = parse_formatted_text(cursor);
  return message;
}

}  // namespace millrace::cnc::nc::syntax
