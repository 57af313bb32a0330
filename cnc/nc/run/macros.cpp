#include "cnc/nc/run/macros.hpp"

#include <utility>
#include <vector>

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

// The vendor's limits are settings; these are our choice.
constexpr std::size_t most_macros = 1'000;

// Reads a whole macro text with one of the parsers.
template <class Node>
Result<std::shared_ptr<const Node>> read_text(std::string_view name, const std::string& text,
                                              Node (*parse)(syntax::Cursor&)) {
  std::vector<Diagnostic> mistakes;
  syntax::Cursor cursor("macro \"" + std::string(name) + '"', text, mistakes);
  auto node = std::make_shared<const Node>(parse(cursor));
  cursor.next_block();
  if (!mistakes.empty()) {
    return fault(mistakes.front().id, mistakes.front().to_string());
  }
  if (!cursor.at_program_end()) {
    return fault(0, "the macro \"" + std::string(name) + "\" has more than one block");
  }
  return node;
}

}  // namespace

Result<void> Macros::define(const std::string& name, const std::string& text) {
  if (macros_.size() >= most_macros && !macros_.contains(name)) {
    return fault(0, "there are " + std::to_string(most_macros) +
                        " macros already; forget them with #INIT MACRO TAB");
  }
  macros_.insert_or_assign(name, Macro{text, nullptr, nullptr});
  return {};
}

const std::string& Macros::text(std::string_view name) const {
  return macros_.find(name)->second.text;
}

Result<Macros::Macro*> Macros::find(std::string_view name) {
  const auto found = macros_.find(name);
  if (found == macros_.end()) {
    return fault(0, "there is no macro \"" + std::string(name) + '"');
  }
  return &found->second;
}

Result<std::shared_ptr<const syntax::Expression>> Macros::expression(std::string_view name) {
  return find(name).and_then(
      [&](Macro* macro) -> Result<std::shared_ptr<const syntax::Expression>> {
        if (!macro->expression) {
          auto parsed = read_text(name, macro->text, syntax::parse_expression);
          if (!parsed) {
            return parsed;
          }
          macro->expression = std::move(*parsed);
        }
        return macro->expression;
      });
}

Result<std::shared_ptr<const syntax::Words>> Macros::words(std::string_view name) {
  return find(name).and_then([&](Macro* macro) -> Result<std::shared_ptr<const syntax::Words>> {
    if (!macro->words) {
      auto parsed = read_text(name, macro->text, syntax::parse_words);
      if (!parsed) {
        return parsed;
      }
      macro->words = std::move(*parsed);
    }
    return macro->words;
  });
}

}  // namespace millrace::cnc::nc::run
