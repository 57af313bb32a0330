// my-service: answers each request with the number of its bytes. Replace what it does by what you
// need.
#include "services/sdk/main.hpp"

#include <string>

namespace sdk = millrace::services::sdk;

/// Runs on a thread of its own for one call after the other (--concurrency N: for N at a time).
/// What it throws becomes an error answer. See docs/writing-a-service.md.
static sdk::Response answer(const sdk::Call& call) {
  return {.text = std::to_string(call.text().size()), .state = 1};
}

int main(int argc, char** argv) {
  const sdk::ServiceOptions options{
      // Draw your own with uuidgen. NC programs write it to V.G.SERVICE.UUID.
      .uuid = "b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e",
      .name = "my-service",
      .description = "Answers each request with the number of its bytes",
      .version = "1.0",
  };
  return sdk::serve(argc, argv, options, answer);
}
