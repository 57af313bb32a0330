// my-service: answers each request with the number of its bytes (answer.cpp).
#include "services/sdk/main.hpp"

#include "answer.hpp"

int main(int argc, char** argv) {
  const millrace::services::sdk::ServiceOptions options{
      // Make your own with uuidgen. NC programs write it to V.G.SERVICE.UUID.
      .uuid = "b3be5ea2-290f-452a-a581-bf9eecf7df26",
      .name = "my-service",
      .description = "Answers each request with the number of its bytes",
      .version = "1.0",
  };
  return millrace::services::sdk::serve(argc, argv, options, answer);
}
