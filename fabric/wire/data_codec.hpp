// The codecs of machine data and program events; see fabric/wire/codec.hpp.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

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
  /// Of things that have a value: `value_of` is a member, or a function that gives a reference.
  template <typename Thing, typename ValueOf>
  static Encoded<ValueList> encode(const std::vector<Thing>& things, ValueOf value_of) {
    ValueList list;
    list.samples_.reserve(things.size());
    for (const Thing& thing : things) {
      if (auto added = list.add(std::invoke(value_of, thing)); !added) {
        return tl::unexpected(std::move(added.error()));
      }
    }
    return list;
  }
  [[nodiscard]] std::vector<millrace_Value>& samples() { return samples_; }

 private:
  static const Value& as_it_is(const Value& value) { return value; }
  tl::expected<void, std::string> add(const Value& value);

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
