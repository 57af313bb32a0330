// The macros of a channel: "NAME" = "text". They live until #INIT MACRO TAB or the channel's end
// (IB/tccncprogramming/15557228683, documented).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "cnc/nc/syntax/statement.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// Deepest nesting of macros; it also ends a macro that uses itself.
inline constexpr int deepest_macro = 10;

class Macros {
 public:
  values::Result<void> define(const std::string& name, const std::string& text);
  void clear() { macros_.clear(); }
  [[nodiscard]] bool contains(std::string_view name) const { return macros_.contains(name); }
  /// The text of an existing macro.
  [[nodiscard]] const std::string& text(std::string_view name) const;
  /// The macro's text, parsed as an expression or as the words of a block; a fault if it is not
  /// one, or if the macro does not exist. Parsed once, then kept.
  values::Result<std::shared_ptr<const syntax::Expression>> expression(std::string_view name);
  values::Result<std::shared_ptr<const syntax::Words>> words(std::string_view name);

 private:
  struct Macro {
    std::string text;
    std::shared_ptr<const syntax::Expression> expression;
    std::shared_ptr<const syntax::Words> words;
  };
  values::Result<Macro*> find(std::string_view name);

  std::map<std::string, Macro, std::less<>> macros_;
};

}  // namespace millrace::cnc::nc::run
