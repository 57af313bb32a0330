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

/// Counts the nesting of macros; a fault beyond ten levels also ends a macro that uses itself.
class MacroLevel {
 public:
  MacroLevel(int& depth, const std::string& name);
  ~MacroLevel() { --depth_; }
  MacroLevel(const MacroLevel&) = delete;
  MacroLevel& operator=(const MacroLevel&) = delete;

 private:
  int& depth_;
};

class Macros {
 public:
  void define(const std::string& name, const std::string& text);
  void clear() { macros_.clear(); }
  [[nodiscard]] bool contains(std::string_view name) const { return macros_.contains(name); }
  /// The text of an existing macro.
  [[nodiscard]] const std::string& text(std::string_view name) const;
  /// The macro's text, parsed as an expression or as the words of a block; a fault if it is not
  /// one, or if the macro does not exist. Parsed once, then kept.
  std::shared_ptr<const syntax::Expression> expression(std::string_view name);
  std::shared_ptr<const syntax::Words> words(std::string_view name);

 private:
  struct Macro {
    std::string text;
    std::shared_ptr<const syntax::Expression> expression;
    std::shared_ptr<const syntax::Words> words;
  };
  Macro& find(std::string_view name);

  std::map<std::string, Macro, std::less<>> macros_;
};

}  // namespace millrace::cnc::nc::run
