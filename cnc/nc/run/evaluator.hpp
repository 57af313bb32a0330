// Evaluates expressions; reads and writes the variables that they name.
#pragma once

#include <string>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/run/macros.hpp"
#include "cnc/nc/run/memory.hpp"
#include "cnc/nc/run/system_variables.hpp"
#include "cnc/nc/syntax/expression.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// One object for each operation. A fault aborts the program (values::Aborted).
class Evaluator {
 public:
  /// The scopes of names.
  struct Scope {
    Memory& memory;
    Macros& macros;
    const SystemVariables& system;
    Environment& environment;
  };
  explicit Evaluator(Scope scope) : scope_(scope) {}

  /// A quoted text with the name of a macro becomes the macro's value.
  Value evaluate(const syntax::Expression& expression);
  /// The same where a string is valid: a quoted text remains a string.
  Value evaluate_text(const syntax::Expression& expression);
  double number(const syntax::Expression& expression);
  long integer(const syntax::Expression& expression);
  Value read(const syntax::Reference& reference);
  void write(const syntax::Reference& reference, const Value& value);
  /// The name with its indices computed: "V.G.NP[98].V.X", "P12[3]". Not for @P1.
  std::string name_of(const syntax::Reference& reference);
  /// Not an overload of name_of(): to choose between the two, Clang copies a Variable, whose
  /// expressions cannot be copied.
  std::string name_of_variable(const syntax::Variable& variable) { return resolve(variable); }
  /// Counts a macro of this operation; a fault beyond the limit (macros that use each other several
  /// times grow without bounds).
  void count_macro(const std::string& name);
  /// The name of a program: literal, in a macro or in a variable.
  std::string name_of(const syntax::Name& name);

 private:
  Value value_of(const syntax::Missing& missing);
  Value value_of(const syntax::Number& number);
  Value value_of(const syntax::Text& text);
  Value value_of(const syntax::Unary& unary);
  Value value_of(const syntax::Binary& binary);
  Value value_of(const syntax::Call& call);
  Value value_of(const syntax::Parameter& parameter);
  Value value_of(const syntax::Variable& variable);
  Value value_of(const syntax::CycleParameter& parameter);
  Value value_of(const syntax::Query& query);
  std::string resolve(const syntax::Parameter& parameter);
  std::string resolve(const syntax::Variable& variable);
  std::string resolve(const syntax::CycleParameter& parameter);
  /// "[2][0]"
  std::string indices_of(const std::vector<syntax::Expression>& elements);
  [[nodiscard]] values::Result<Value> read_variable(const std::string& name) const;
  bool exists(const syntax::Reference& reference);
  double size_of(const syntax::Query& query);
  [[nodiscard]] bool is_macro(const syntax::Expression& expression) const;

  Scope scope_;
  /// Nesting depth of macros, and number of macros in this operation.
  int macro_depth_ = 0;
  int macros_used_ = 0;
};

}  // namespace millrace::cnc::nc::run
