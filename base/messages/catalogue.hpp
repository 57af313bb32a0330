// The sentences that processes of a plant say to one another and to people, each with its code. A
// code is never used again for another meaning; its English may change. A sentence is added here
// and where it is said; tools/web/page/texts has the translations.
//
//   base::messages::unknown_uuid(uuid)
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <string>
#include <string_view>

#include "base/messages/format.hpp"
#include "base/messages/message.hpp"

namespace millrace::base::messages {

/// A literal as a template argument.
template <std::size_t size>
struct Literal {
  char characters[size]{};
  // NOLINTNEXTLINE(google-explicit-constructor,hicpp-explicit-conversions): written as a literal.
  constexpr Literal(const char (&text)[size]) { std::copy_n(text, size, characters); }
  [[nodiscard]] constexpr std::string_view view() const { return {characters, size - 1}; }
  /// Each {} in it, by index: with UBSan, GCC 12 takes a search in a std::string_view of a template
  /// argument for no constant expression.
  [[nodiscard]] constexpr std::size_t places() const {
    std::size_t places = 0;
    for (std::size_t i = 0; i + 1 < size; ++i) {
      places += characters[i] == '{' && characters[i + 1] == '}' ? 1 : 0;
    }
    return places;
  }
};

/// A sentence of the catalogue; called with its arguments it is a Message.
template <Literal its_code, Literal its_sentence>
struct Sentence {
  static constexpr std::string_view code = its_code.view();
  static constexpr std::string_view sentence = its_sentence.view();

  template <typename... Arguments>
  requires(sizeof...(Arguments) == its_sentence.places()) Message operator()(
      const Arguments&... arguments) const {
    Message message;
    message.code = code;
    (message.arguments.push_back(argument_of(arguments)), ...);
    message.text = fill(message.arguments);
    return message;
  }

  /// Whether `message` is this sentence, with all of its arguments, whatever they are.
  [[nodiscard]] bool is(const Message& message) const {
    return message.code == code && message.arguments.size() == its_sentence.places();
  }

 private:
  template <typename Argument>
  static Message argument_of(const Argument& argument) {
    if constexpr (std::convertible_to<const Argument&, Message>) {
      return argument;
    } else {
      return fmt::to_string(argument);
    }
  }
  static std::string fill(const std::vector<Message>& arguments) {
    std::string text;
    std::string_view rest = sentence;
    for (const Message& argument : arguments) {
      const std::size_t place = rest.find("{}");
      text += rest.substr(0, place);
      text += argument.text;
      rest.remove_prefix(place + 2);
    }
    return text += rest;
  }
};

#define MILLRACE_MESSAGE(code, sentence) inline constexpr Sentence<#code, sentence> code;
#include "base/messages/catalogue.def"
#undef MILLRACE_MESSAGE

struct CatalogueRow {
  std::string_view code;
  std::string_view sentence;
};
/// All of the catalogue, in its order.
inline constexpr auto catalogue = std::to_array<CatalogueRow>({
#define MILLRACE_MESSAGE(code, sentence) {#code, sentence},
#include "base/messages/catalogue.def"
#undef MILLRACE_MESSAGE
});

}  // namespace millrace::base::messages
