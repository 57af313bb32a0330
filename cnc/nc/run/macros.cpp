#include "cnc/nc/run/macros.hpp"

#include <vector>

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

// The vendor's limits are settings; these are our choice.
constexpr std::size_t most_macros = 1'000;
constexpr int deepest_macro = 10;

// Reads a whole macro text with one of the parsers.
template <class Node>
std::shared_ptr<const Node> read_text(std::string_view name, const std::string& text,
                                      Node (*parse)(syntax::Cursor&)) {
  std::vector<Diagnostic> mistakes;
  syntax::Cursor cursor("macro \"" + std::string(name) + '"', text, mistakes);
  auto node = std::make_shared<const Node>(parse(cursor));
  cursor.next_block();
  if (!mistakes.empty()) {
    fail(mistakes.front().id, mistakes.front().to_string());
  }
  if (!cursor.at_program_end()) {
    fail(0, "the macro \"" + std::string(name) + "\" has more than one block");
  }
  return node;
}

}  // namespace

void Macros::define(const std::string& name, const std::string& text) {
  if (macros_.size() >= most_macros && !macros_.contains(name)) {
    fail(0, "there are " + std::to_string(most_macros) +
                " macros already; forget them with #INIT MACRO TAB");
  }
  macros_.insert_or_assign(name, Macro{text, nullptr, nullptr});
}

const std::string& Macros::text(std::string_view name) const {
  return macros_.find(name)->second.text;
}

Macros::Macro& Macros::find(std::string_view name) {
  const auto found = macros_.find(name);
  if (found == macros_.end()) {
    fail(0, "there is no macro \"" + std::string(name) + '"');
  }
  return found->second;
}

std::shared_ptr<const syntax::Expression> Macros::expression(std::string_view name) {
  Macro& macro = find(name);
  if (!macro.expression) {
    macro.expression = read_text(name, macro.text, syntax::parse_expression);
  }
  return macro.expression;
}

std::shared_ptr<const syntax::Words> Macros::words(std::string_view name) {
  Macro& macro = find(name);
  if (!macro.words) {
    macro.words = read_text(name, macro.text, syntax::parse_words);
  }
  return macro.words;
}

MacroLevel::MacroLevel(int& depth, const std::string& name) : depth_(depth) {
  if (depth == deepest_macro) {
    fail(0, "macros are nested deeper than " + std::to_string(deepest_macro) + " levels, or \"" +
                name + "\" uses itself");
  }
  ++depth;
}

}  // namespace millrace::cnc::nc::run
