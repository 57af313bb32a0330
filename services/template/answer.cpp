#include "answer.hpp"

#include <string>

namespace sdk = millrace::services::sdk;

sdk::Response answer(const sdk::Call& call) {
  return {.text = std::to_string(call.text().size()), .state = 1};
}
