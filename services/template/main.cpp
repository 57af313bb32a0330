// my-service: answers each request with the number of its bytes. Replace this by your own work.
#include "services/sdk/main.hpp"

#include <string>

namespace sdk = millrace::services::sdk;

/// Runs on its own thread, one call after the other (--concurrency N: N at a time). An exception
/// becomes an error response. See docs/how-to/services-in-cpp-and-c.md.
static sdk::Response answer(const sdk::Call& call) {
  return {.text = std::to_string(call.text().size()), .state = 1};
}

int main(int argc, char** argv) {
  const sdk::ServiceOptions options{
      // Make your own with uuidgen. NC programs write it to V.G.SERVICE.UUID.
      .uuid = "b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e",
      .name = "my-service",
      .description = "Answers each request with the number of its bytes",
      .version = "1.0",
  };
  return sdk::serve(argc, argv, options, answer);
}
