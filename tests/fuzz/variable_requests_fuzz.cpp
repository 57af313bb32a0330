// Any requests about variables, and a controller with any responses: only variables that the rules
// allow are written, no client gets two answers, and each gets one in the end.
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>

#include "cnc/variables/value.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace {

using namespace millrace;
using namespace millrace::gateway::variables;
using cnc::ads::ErrorCode;

/// Numbers and texts from the input; zeros after its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool empty() const { return at_ >= size_; }
  std::uint8_t byte() { return empty() ? std::uint8_t{0} : data_[at_++]; }
  std::string text() {
    std::string made;
    for (std::size_t left = byte() % 40U; left > 0; --left) {
      made += static_cast<char>(byte());
    }
    return made;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

void expect(bool holds) {
  if (!holds) {
    std::abort();
  }
}

cnc::variables::Reading reading_of(Input& in) {
  cnc::variables::Reading reading;
  // A controller's description never gives a type another size than its own: element_type().
  cnc::variables::Description description;
  description.type = static_cast<cnc::variables::Type>(in.byte() % 11U);
  description.size = in.byte() % 8U + 1U;
  reading.type = cnc::variables::element_type(description).value_or(reading.type);
  reading.length = in.byte();
  reading.access = static_cast<cnc::variables::Access>(in.byte() % 3U);
  return reading;
}

void answer(VariableRequests& requests, const Step& step, Input& in, gateway::Moment now) {
  const auto error = static_cast<ErrorCode>(in.byte() % 4U == 0 ? 0x700U + in.byte() % 0x50U : 0U);
  if (const auto* look_up = std::get_if<gateway::data::Resolve>(&step)) {
    std::vector<Found> found;
    for (std::size_t i = 0; i < look_up->names.size(); ++i) {
      found.push_back(error == ErrorCode::none
                          ? Found(reading_of(in))
                          : tl::unexpected(cnc::variables::LookupError{error, in.text()}));
    }
    requests.on_resolved(found, 2, now);
  } else if (const auto* read = std::get_if<gateway::data::Read>(&step)) {
    std::vector<Answered> answers;
    for (std::size_t i = 0; i < read->readings.size(); ++i) {
      const std::string bytes = in.text();
      answers.push_back(error == ErrorCode::none
                            ? Answered(cnc::variables::Bytes(bytes.begin(), bytes.end()))
                            : tl::unexpected(error));
    }
    requests.on_read(answers, 1, in.byte() % 2U == 0, now);
  } else if (const auto* write = std::get_if<WriteOne>(&step)) {
    expect(write->name.starts_with("V.E.") && !is_service_interface(write->name));
    requests.on_written(error == ErrorCode::none ? cnc::ads::Result<void>() : tl::unexpected(error),
                        1, now);
  } else {
    requests.on_listed(error == ErrorCode::none ? cnc::ads::Result<Page>(Page{in.byte(), {}})
                                                : tl::unexpected(error),
                       2, now);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input in(data, size);
  VariableRequests sut("press", {.writable = {{"V.E.*"}}, .requests_per_second = 1000});
  gateway::Moment now{gateway::SteadyTime{} + std::chrono::hours(1), {}};
  sut.on_up({1, 2}, now);
  std::map<fabric::InstanceId, int> owed;
  std::uint32_t requests = 0;
  const auto count = [&] {
    for (const auto& answer : sut.take_output().answers) {
      expect(--owed[answer.reply.token] >= 0);
    }
  };
  while (!in.empty()) {
    now.steady += std::chrono::microseconds(in.byte() * 40);
    switch (in.byte() % 8U) {
      case 0: {
        sut.on_down(in.text(), now);
        sut.on_up({1}, now);
        break;
      }
      case 1:
        sut.on_time(now);
        break;
      case 2:
      case 3:
        if (const auto step = sut.next(now)) {
          answer(sut, *step, in, now);
        }
        break;
      default: {
        fabric::VariableRequest request{
            .key = {"press", static_cast<std::uint16_t>(1 + in.byte() % 2U)},
            .action = static_cast<fabric::VariableAction>(in.byte() % 4U)};
        request.requester.bytes[0] = in.byte();
        request.token.bytes[0] = static_cast<std::uint8_t>(++requests & 0xFFU);
        request.token.bytes[1] = static_cast<std::uint8_t>(requests >> 8U);
        request.patience = std::chrono::milliseconds(in.byte());
        for (std::size_t names = in.byte() % 5U; names > 0; --names) {
          request.names.push_back(in.byte() % 2U == 0 ? "V.E." + in.text() : in.text());
          if (request.action == fabric::VariableAction::write) {
            request.values.push_back({in.text()});
          }
        }
        owed[request.token] = 1;
        sut.on_request(request, now);
        break;
      }
    }
    count();
  }
  sut.on_down("the end", now);
  count();
  for (const auto& [token, left] : owed) {
    expect(left == 0);
  }
  return 0;
}
