// Expressions and references to variables, which the parser makes and the interpreter evaluates.
// Immutable after parsing.
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "cnc/nc/values/operations.hpp"

namespace millrace::cnc::nc::syntax {

struct Expression;
using ExpressionPointer = std::unique_ptr<Expression>;

/// No value: the block has a mistake, and its program never runs.
struct Missing {};

struct Number {
  double value = 0;
};

/// "…": a string, or the name of a macro if one of that name is defined.
struct Text {
  std::string text;
};

enum class UnaryOperator { minus, logical_not };

struct Unary {
  UnaryOperator operation{};
  ExpressionPointer operand;
};

struct Binary {
  values::BinaryOperator operation{};
  ExpressionPointer left;
  ExpressionPointer right;
};

struct Call {
  const values::Function* function = nullptr;
  std::vector<Expression> arguments;
};

/// P10, P[expr], PP10 (one indirection), P10[i][j].
struct Parameter {
  int indirections = 0;
  ExpressionPointer index;
  std::vector<Expression> elements;
};

/// One part of a variable's name: NP[98] in V.G.NP[98].V.X.
struct VariablePart {
  std::string name;
  std::vector<Expression> elements;
};

/// V.… or SD.… (system data) with all its parts; the first is "V" or "SD".
struct Variable {
  std::vector<VariablePart> parts;
};

/// @P1: an argument of a cycle.
struct CycleParameter {
  ExpressionPointer number;
};

using Reference = std::variant<Parameter, Variable, CycleParameter>;

/// A function of a variable itself, not of its value; or whether the channel has an M or H
/// function.
enum class QueryKind { exists, size_of, is_string, is_number, has_function };

/// EXIST[V.P.A], SIZEOF[V.P.A, 2], EXIST[M80]
struct Query {
  QueryKind kind{};
  /// Null for has_function.
  std::unique_ptr<Reference> subject;
  /// The dimension of SIZEOF, the number of has_function.
  ExpressionPointer argument;
};

struct Expression {
  using Node = std::variant<Missing, Number, Text, Unary, Binary, Call, Parameter, Variable,
                            CycleParameter, Query>;
  Node node;
};

}  // namespace millrace::cnc::nc::syntax
