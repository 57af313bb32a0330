// Any bytes as a request and as the data on a receiver's line: answers fit, and a value from the
// stream is printable.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include "services/dial_gauge/answering.hpp"
#include "services/dial_gauge/receiver.hpp"
#include "services/dial_gauge/simulated_source.hpp"

using namespace millrace::services::dial_gauge;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

void check(const millrace::services::sdk::Response& response) {
  require(response.state != 0);
  require(response.text.size() <= 127);
  require(response.text.find('\0') == std::string::npos);
  require(response.state == 1 || response.text.starts_with("ERROR: "));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  Answering answering({}, [](const Zeros&) { return tl::expected<void, std::string>(); });
  answering.add({.name = "G1"}, std::make_unique<SimulatedSource>(Simulation{}, Time{}));
  check(answering.answer(bytes.substr(0, 127), Time{}));

  for (const Form form : {Form::u_wave, Form::digimatic}) {
    const auto receiver = std::make_shared<Receiver>(form, Unit::inch);
    receiver->opened();
    for (const std::string& broken : receiver->hear(bytes, Time{})) {
      require(!broken.empty() && broken.size() <= 64);
    }
    answering.add({.name = "radio", .decimals = 6}, std::make_unique<RadioSource>(receiver, 0));
    check(answering.answer("READ radio", Time{}));
    check(answering.answer("STATUS radio", Time{}));
  }
  return 0;
}
