// The topics of questions about variables, and the codecs of what travels there; see codec.hpp.
//
//   millrace/variable/request   tools to gateways        partition FABRIC
//   millrace/variable/reply     gateway to who asks      partition FABRIC/ASKER
//
// Both without a key. Requests are volatile: who asks says it again until it is answered. Of
// replies the last one waits, since who asks for the first time may be found only now.
#pragma once

#include "fabric/variables.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/wire/data_codec.hpp"
#include "idl/variables.h"

namespace millrace::fabric::wire {

extern const Topic variable_request_topic;
extern const Topic variable_reply_topic;

/// "millrace/8d0c4e6a-…": where the replies to one asker travel.
std::string asker_partition(std::string_view fabric, const InstanceId& asker);

/// Points into lists that move with it, and into the request.
struct VariableRequestSample : millrace_VariableRequest {
  VariableRequestSample() : millrace_VariableRequest{} {}
  VariableRequestSample(VariableRequestSample&&) = default;
  VariableRequestSample& operator=(VariableRequestSample&&) = default;
  std::vector<millrace_ValueText> name_list{};
  std::vector<std::vector<millrace_ValueText>> element_lists{};
  std::vector<millrace_ValueTexts> value_list{};
};

template <>
struct Codec<VariableRequest> {
  using Sample = millrace_VariableRequest;
  static const Topic& topic() { return variable_request_topic; }
  static Encoded<VariableRequestSample> encode(const VariableRequest& value);
  /// Of one with too much nothing is copied: `excess` says what it is.
  static VariableRequest decode(const Sample& sample);
};

struct VariableReplySample : millrace_VariableReply {
  VariableReplySample() : millrace_VariableReply{} {}
  VariableReplySample(VariableReplySample&&) = default;
  VariableReplySample& operator=(VariableReplySample&&) = default;
  ValueList values{};
  ValueList before_values{};
  std::vector<millrace_VariableResult> result_list{};
};

template <>
struct Codec<VariableReply> {
  using Sample = millrace_VariableReply;
  static const Topic& topic() { return variable_reply_topic; }
  static Encoded<VariableReplySample> encode(const VariableReply& value);
  static VariableReply decode(const Sample& sample);
};

}  // namespace millrace::fabric::wire
