#include "answer.hpp"

#include <string>

#include "services/text/answer.hpp"

namespace sdk = millrace::services::sdk;
namespace text = millrace::services::text;

sdk::Response answer(const sdk::Call& call) {
  if (call.text().empty()) {
    return text::error(text::state_bad_request, "expected a text");
  }
  return {.text = std::to_string(call.text().size()), .state = text::state_ok};
}
