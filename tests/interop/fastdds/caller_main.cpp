// fastdds_caller: calls a service of the fabric, one call after the other, and prints each answer.
//
//   --domain N --fabric NAME --uuid UUID --calls N --channels N
//   --request TEXT        with '#' for the number of the call
#include <iostream>

#include "arguments.hpp"
#include "caller.hpp"

int main(int argc, char** argv) {
  using namespace millrace::tests::interop::fastdds;
  constexpr std::chrono::seconds patience(20);
  const Arguments arguments(argc, argv);
  Caller caller(static_cast<std::uint32_t>(arguments.number("--domain", 0)),
                arguments.text("--fabric", "millrace"), arguments.text("--uuid", ""));
  if (!caller.await_instance(patience)) {
    std::cerr << "no instance that takes calls was found" << std::endl;
    return 1;
  }
  const int calls = arguments.number("--calls", 1);
  const int channels = arguments.number("--channels", 1);
  for (int number = 1; number <= calls; ++number) {
    std::string text = arguments.text("--request", "#");
    if (const auto mark = text.find('#'); mark != std::string::npos) {
      text.replace(mark, 1, std::to_string(number));
    }
    const auto reply =
        caller.call(static_cast<std::uint16_t>(1 + number % channels), text, patience);
    if (!reply) {
      std::cerr << "call " << number << " was not answered" << std::endl;
      return 1;
    }
    std::cout << "answer " << number << " state " << reply->state() << ": "
              << std::string(reply->text().begin(), reply->text().end()) << '\n';
  }
  std::cout << "done" << std::endl;
  return 0;
}
