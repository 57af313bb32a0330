// The effects of an NC program's operation on a service call, in order. Pure.
//
//   for (const Effect& effect : effects_of(operation.statement)) …
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cnc/nc/syntax/statement.hpp"

namespace millrace::tools::lint {

namespace syntax = cnc::nc::syntax;

struct Effect {
  enum class Kind : std::uint8_t {
    /// V.G.SERVICE.UUID, REQUEST, REQUEST_STATE is written.
    uuid,
    request,
    request_state,
    /// RESPONSE_STATE, RESPONSE is read.
    response_state_read,
    response_read,
    /// The program writes RESPONSE_STATE or RESPONSE itself.
    response_written,
    /// The program waits until RESPONSE_STATE shows a response.
    wait,
    /// The motion of an axis.
    motion,
    flush,
    /// M02, M30, or an error that ends the program.
    end,
    /// M17, M29
    end_of_subprogram,
    /// A subprogram that only the channel's configuration names: G80 to G89, G800 to G839.
    configured_call,
  };

  /// Why a wait does not wait for the answer.
  enum class Flaw : std::uint8_t {
    none,
    /// Neither RESPONSE_STATE nor RESPONSE is read.
    other_variable,
    /// Its condition is true before the response.
    over_at_once,
    /// No response makes it true.
    never_over,
  };

  Kind kind{};
  /// uuid, request: what is written, if it is a constant.
  std::optional<std::string> text{};
  /// request_state: the same.
  std::optional<double> number{};
  /// wait: it waits for one state, so there is nothing left to check.
  bool judged = false;
  /// wait: with a time limit.
  bool limited = false;
  Flaw flaw = Flaw::none;
  /// response_state_read, response_read: it is only shown to people.
  bool shown = false;
};

std::vector<Effect> effects_of(const syntax::Statement& statement);

/// A condition that compares RESPONSE_STATE with one value: after it the value is known.
bool asks_for_one_state(const syntax::Expression& condition);

/// The value that is certain without running the program; nullopt otherwise.
std::optional<std::string> constant_text(const syntax::Expression& expression);
std::optional<double> constant_number(const syntax::Expression& expression);

}  // namespace millrace::tools::lint
