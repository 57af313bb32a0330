// The codecs of machine data and program events; see fabric/wire/codec.hpp.
#pragma once

#include "fabric/data.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/wire/data_topics.hpp"
#include "idl/data.h"

namespace millrace::fabric::wire {

/// The values of a sample, which point into lists that move with them.
class ValueList {
 public:
  /// The error names the value that does not fit. Borrows the elements.
  static Encoded<ValueList> encode(const std::vector<Value>& values);
  [[nodiscard]] std::vector<millrace_Value>& samples() { return samples_; }

 private:
  std::vector<millrace_Value> samples_;
  std::vector<std::vector<millrace_ValueText>> texts_;
};
Value decode_value(const millrace_Value& sample);

struct DataSampleSample : millrace_DataSample {
  DataSampleSample() : millrace_DataSample{} {}
  DataSampleSample(DataSampleSample&&) = default;
  DataSampleSample& operator=(DataSampleSample&&) = default;
  ValueList value_list{};
};

template <>
struct Codec<DataSample> {
  using Sample = millrace_DataSample;
  static const Topic& topic() { return data_topic; }
  static Encoded<DataSampleSample> encode(const DataSample& value);
  static DataSample decode(const Sample& sample);
};

template <>
struct Codec<ProgramEvent> {
  using Sample = millrace_ProgramEvent;
  static const Topic& topic() { return program_topic; }
  static Encoded<Sample> encode(const ProgramEvent& value);
  static ProgramEvent decode(const Sample& sample);
};

}  // namespace millrace::fabric::wire
