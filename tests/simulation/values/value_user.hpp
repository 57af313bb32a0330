// Who reads and writes variables of the controllers through their gateways and follows their data,
// and judges what comes: a question is answered once, a value was read after it was asked for, what
// is written is written once. Without faults each question is answered, and data are told.
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
  /// When the data of a machine were told last, or it was not served.
  std::map<std::string, Time> told_;
};

}  // namespace millrace::tests::simulation
