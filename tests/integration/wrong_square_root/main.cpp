// The square root service with a wrong last digit, which a replay with --verify must find.
#include "services/sdk/main.hpp"

#include "services/square_root/root.hpp"

int main(int argc, char** argv) {
  using namespace millrace::services;
  const sdk::ServiceOptions options{
      .uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47",
      .name = "wrong_square_root",
      .description = "Answers a number with nearly its square root",
  };
  return sdk::serve(argc, argv, options, [](const sdk::Call& call) {
    sdk::Response response = square_root::square_root(call.text());
    if (response.state == square_root::state_ok) {
      char& digit = response.text.back();
      digit = digit == '9' ? '8' : static_cast<char>(digit + 1);
    }
    return response;
  });
}
