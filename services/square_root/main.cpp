// millrace-square-root: the sample service of the vendor's manual.
#include "services/sdk/main.hpp"

#include "base/program/version.hpp"
#include "services/square_root/root.hpp"

int main(int argc, char** argv) {
  using namespace millrace::services;
  const sdk::ServiceOptions options{
      .uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47",
      .name = "square_root",
      .description = "Answers a number with its square root",
      .version = millrace::base::program::version(),
      .run_inline = true,
  };
  return sdk::serve(argc, argv, options,
                    [](const sdk::Call& call) { return square_root::square_root(call.text()); });
}
