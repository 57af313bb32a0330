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

/// One object for each operation.
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
  values::Result<Value> evaluate(const syntax::Expression& expression);
  /// The same where a string is valid: a quoted text remains a string.
  values::Result<Value> evaluate_text(const syntax::Expression& expression);
  values::Result<double> number(const syntax::Expression& expression);
  values::Result<long> integer(const syntax::Expression& expression);
  values::Result<Value> read(const syntax::Reference& reference);
  values::Result<void> write(const syntax::Reference& reference, const Value& value);
  /// The name with its indices computed: "V.G.NP[98].V.X", "P12[3]". Not for @P1.
  values::Result<std::string> name_of(const syntax::Reference& reference);
  /// Not an overload of name_of(): to choose between the two, Clang copies a Variable, whose
  /// expressions cannot be copied.
  values::Result<std::string> name_of_variable(const syntax::Variable& variable) {
    return resolve(variable);
  }
  /// Counts a macro of this operation; a fault beyond the limit (macros that use each other several
  /// times grow without bounds).
  values::Result<void> count_macro(const std::string& name);
  /// The name of a program: literal, in a macro or in a variable.
  values::Result<std::string> name_of(const syntax::Name& name);

 private:
  values::Result<Value> value_of(const syntax::Number& number);
  values::Result<Value> value_of(const syntax::Text& text);
  values::Result<Value> value_of(const syntax::Unary& unary);
  values::Result<Value> value_of(const syntax::Binary& binary);
  values::Result<Value> value_of(const syntax::Call& call);
  values::Result<Value> value_of(const syntax::Parameter& parameter);
  values::Result<Value> value_of(const syntax::Variable& variable);
  values::Result<Value> value_of(const syntax::CycleParameter& parameter);
  values::Result<Value> value_of(const syntax::Query& query);
  values::Result<std::string> resolve(const syntax::Parameter& parameter);
  values::Result<std::string> resolve(const syntax::Variable& variable);
  values::Result<std::string> resolve(const syntax::CycleParameter& parameter);
  values::Result<void> append_elements(const std::vector<syntax::Expression>& elements,
                                       std::string& name);
  values::Result<Value> read_variable(const std::string& name);
  values::Result<bool> exists(const syntax::Reference& reference);
  values::Result<double> size_of(const syntax::Query& query);
  [[nodiscard]] bool is_macro(const syntax::Expression& expression) const;

  Scope scope_;
  /// Nesting depth of macros, and number of macros in this operation.
  int macro_depth_ = 0;
  int macros_used_ = 0;
};

}  // namespace millrace::cnc::nc::run
