#include "fabric/wire/variable_codec.hpp"

#include "fabric/wire/sample_fields.hpp"

namespace millrace::fabric::wire {

namespace {

static_assert(convert<int>(VariableAction::list) == millrace_variables_list);

/// Of one asker: what it may be behind.
constexpr std::int32_t questions_in_flight = 64;

std::vector<millrace_ValueText> borrow_texts(const std::vector<std::string>& texts) {
  std::vector<millrace_ValueText> borrowed;
  borrowed.reserve(texts.size());
  for (const std::string& text : texts) {
    borrowed.push_back(borrow_bytes<millrace_ValueText>(text));
  }
  return borrowed;
}

template <typename Texts>
std::vector<std::string> get_texts(const Texts& field) {
  std::vector<std::string> texts;
  texts.reserve(field._length);
  for (const millrace_ValueText& text : elements_of(field)) {
    texts.push_back(get(elements_of(text)));
  }
  return texts;
}

/// What a request has too much of; empty if it is none.
std::string excess_of(const millrace_VariableRequest& sample) {
  if (sample.names._length > most_variables) {
    return fmt::format("{} names; at most {} are answered in one request", sample.names._length,
                       most_variables);
  }
  if (sample.values._length > most_variables) {
    return fmt::format("values for {} names; at most {} are written in one request",
                       sample.values._length, most_variables);
  }
  std::size_t bytes = 0;
  std::size_t elements = 0;
  for (const millrace_ValueText& name : elements_of(sample.names)) {
    bytes += name._length;
  }
  for (const millrace_ValueTexts& list : elements_of(sample.values)) {
    elements += list._length;
    for (const millrace_ValueText& text : elements_of(list)) {
      bytes += text._length;
    }
  }
  if (bytes > most_variable_bytes) {
    return fmt::format("{} bytes of names and values; at most {} go into one request", bytes,
                       most_variable_bytes);
  }
  return elements > most_variable_elements
             ? fmt::format("{} elements; at most {} are written in one request", elements,
                           most_variable_elements)
             : std::string();
}

/// `sample` has nothing of the value yet.
void put_result(millrace_VariableResult& sample, const VariableResult& result) {
  sample.error = result.error;
  sample.writable = result.writable;
  sample.size = result.size;
  borrow(sample.dimensions, result.dimensions);
}

VariableResult get_result(const millrace_VariableResult& sample) {
  const auto dimensions = elements_of(sample.dimensions);
  return {.value = decode_value(sample.value),
          .error = sample.error,
          .writable = sample.writable,
          .size = sample.size,
          .dimensions = {dimensions.begin(), dimensions.end()}};
}

}  // namespace

const Topic variable_request_topic{"millrace/variable/request", &millrace_VariableRequest_desc,
                                   false, questions_in_flight};
const Topic variable_reply_topic{"millrace/variable/reply", &millrace_VariableReply_desc, true,
                                 questions_in_flight};

std::string asker_partition(std::string_view fabric, const InstanceId& asker) {
  return fmt::format("{}/{}", fabric, asker.to_string());
}

Encoded<VariableRequestSample> Codec<VariableRequest>::encode(const VariableRequest& value) {
  Filler<millrace_VariableRequest> filler;
  filler.key(value.key);
  filler.string(filler.sample.issuer, value.issuer, "issuer");
  put(filler.sample.asker, value.asker);
  put(filler.sample.token, value.token);
  filler.sample.action = convert<millrace_VariableAction>(value.action);
  filler.sample.first = value.first;
  filler.sample.patience_ns = static_cast<std::uint64_t>(value.patience.count());
  filler.sample.age_ns = static_cast<std::uint64_t>(value.age.count());
  filler.sample.at = put(value.at);
  const auto plain = filler.result();
  if (!plain) {
    return tl::unexpected(plain.error());
  }
  VariableRequestSample sample;
  static_cast<millrace_VariableRequest&>(sample) = *plain;
  sample.name_list = borrow_texts(value.names);
  sample.element_lists.reserve(value.values.size());
  sample.value_list.reserve(value.values.size());
  for (const std::vector<std::string>& elements : value.values) {
    auto& list = sample.element_lists.emplace_back(borrow_texts(elements));
    lend(sample.value_list.emplace_back(), list);
  }
  lend(sample.names, sample.name_list);
  lend(sample.values, sample.value_list);
  return sample;
}

VariableRequest Codec<VariableRequest>::decode(const millrace_VariableRequest& sample) {
  VariableRequest value{
      .asker = get(sample.asker),
      .token = get(sample.token),
      .key = get_key(sample),
      .action = convert<VariableAction>(sample.action),
      .first = sample.first,
      .patience = std::chrono::nanoseconds(sample.patience_ns),
      .age = std::chrono::nanoseconds(sample.age_ns),
      .issuer = sample.issuer,
      .at = get(sample.at),
      .excess = excess_of(sample),
  };
  if (!value.excess.empty()) {
    return value;
  }
  value.names = get_texts(sample.names);
  for (const millrace_ValueTexts& elements : elements_of(sample.values)) {
    value.values.push_back(get_texts(elements));
  }
  return value;
}

Encoded<VariableReplySample> Codec<VariableReply>::encode(const VariableReply& value) {
  Filler<millrace_VariableReply> filler;
  filler.string(filler.sample.reason, value.reason, "reason");
  put(filler.sample.token, value.token);
  filler.sample.done = value.done;
  filler.sample.total = value.total;
  filler.sample.at = put(value.at);
  auto plain = filler.result();
  auto values = ValueList::encode(value.results, &VariableResult::value);
  auto before = ValueList::encode(value.before);
  for (const auto* part : {&values, &before}) {
    if (!*part) {
      return tl::unexpected(part->error());
    }
  }
  if (!plain) {
    return tl::unexpected(plain.error());
  }
  VariableReplySample sample;
  static_cast<millrace_VariableReply&>(sample) = *plain;
  sample.values = std::move(*values);
  sample.before_values = std::move(*before);
  sample.result_list.resize(value.results.size());
  for (std::size_t i = 0; i < value.results.size(); ++i) {
    sample.result_list[i].value = sample.values.samples()[i];
    put_result(sample.result_list[i], value.results[i]);
  }
  lend(sample.results, sample.result_list);
  lend(sample.before, sample.before_values.samples());
  return sample;
}

VariableReply Codec<VariableReply>::decode(const millrace_VariableReply& sample) {
  VariableReply value{.token = get(sample.token),
                      .done = sample.done,
                      .reason = sample.reason,
                      .total = sample.total,
                      .at = get(sample.at)};
  for (const millrace_VariableResult& one : elements_of(sample.results)) {
    value.results.push_back(get_result(one));
  }
  for (const millrace_Value& one : elements_of(sample.before)) {
    value.before.push_back(decode_value(one));
  }
  return value;
}

}  // namespace millrace::fabric::wire
