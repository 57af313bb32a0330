// Reads and writes variables of the controllers through their gateways, follows their data and
// checks the results: each question is answered once, a value was read after its question, each
// write is done once. Without faults all questions are answered and data are published.
#pragma once

#include <map>
#include <string>

#include "tests/simulation/plant.hpp"

namespace millrace::tests::simulation {

class ValueUser {
 public:
  ValueUser(Plant& plant, Random random);

  void start();
  /// Faults are over.
  void calm_down() { calm_ = true; }

 private:
  struct Open {
    fabric::VariableRequest request;
    GatewayNumber gateway = 0;
    std::uint64_t life = 0;
    /// A gateway that leaves the channel to another one leaves the question to it, too.
    unsigned times_left = 0;
    Time asked{};
    bool calm = false;
    bool answered = false;
    std::int32_t number = 0;
  };

  void ask();
  void expect_reply(const fabric::InstanceId& token);
  void on_reply(const fabric::VariableReply& reply);
  void on_sample(const fabric::DataSample& sample, Time stood_still);
  void watch();
  void judge_age(const fabric::Value& value, Time oldest, const std::string& what);
  template <typename... Arguments>
  void violated(const char* what, const Arguments&... arguments);

  Plant& plant_;
  Random random_;
  bool calm_ = false;
  std::int32_t last_number_ = 0;
  std::map<fabric::InstanceId, Open> open_;
  /// When the data of a machine were last published, or it was not served.
  std::map<std::string, Time> published_;
};

}  // namespace millrace::tests::simulation
