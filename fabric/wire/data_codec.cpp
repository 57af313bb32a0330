#include "fabric/wire/data_codec.hpp"

#include "fabric/cases.hpp"
#include "fabric/wire/sample_fields.hpp"

namespace millrace::fabric::wire {

namespace {

static_assert(convert<int>(ValueType::string) == millrace_value_string);
static_assert(convert<int>(Quality::refused) == millrace_quality_refused);
static_assert(convert<int>(ProgramEventKind::resumed) == millrace_program_resumed);

std::string get_text(const millrace_ValueText& field) {
  return get(elements_of(field));
}

Elements get_elements(const millrace_Value& sample) {
  switch (convert<ValueType>(sample.type)) {
    case ValueType::real64: {
      const auto reals = elements_of(sample.reals);
      return std::vector<double>(reals.begin(), reals.end());
    }
    case ValueType::string: {
      std::vector<std::string> texts;
      for (const millrace_ValueText& text : elements_of(sample.texts)) {
        texts.push_back(get_text(text));
      }
      return texts;
    }
    default: {
      const auto integers = elements_of(sample.integers);
      return std::vector<std::int64_t>(integers.begin(), integers.end());
    }
  }
}

}  // namespace

Encoded<ValueList> ValueList::encode(const std::vector<Value>& values) {
  return encode(values, &as_it_is);
}

tl::expected<void, std::string> ValueList::add(const Value& value) {
  Filler<millrace_Value> filler;
  filler.string(filler.sample.name, value.name, "variable name");
  filler.string(filler.sample.reason, value.reason, "reason");
  filler.sample.type = convert<millrace_ValueType>(value.type);
  filler.sample.quality = convert<millrace_Quality>(value.quality);
  filler.sample.at = put(value.at);
  filler.sample.is_array = value.is_array;
  auto sample = filler.result();
  if (!sample) {
    return tl::unexpected(fmt::format("{}: {}", value.name, sample.error()));
  }
  std::visit(Cases{[&](const std::vector<std::int64_t>& all) { borrow(sample->integers, all); },
                   [&](const std::vector<double>& all) { borrow(sample->reals, all); },
                   [&](const std::vector<std::string>& all) {
                     auto& texts = texts_.emplace_back();
                     for (const std::string& text : all) {
                       texts.push_back(borrow_bytes<millrace_ValueText>(text));
                     }
                     lend(sample->texts, texts);
                   }},
             value.elements);
  samples_.push_back(*sample);
  return {};
}

Value decode_value(const millrace_Value& sample) {
  return {
      .name = sample.name,
      .type = convert<ValueType>(sample.type),
      .quality = convert<Quality>(sample.quality),
      .at = get(sample.at),
      .is_array = sample.is_array,
      .elements = get_elements(sample),
      .reason = sample.reason,
  };
}

Encoded<DataSampleSample> Codec<DataSample>::encode(const DataSample& value) {
  Filler<millrace_DataSample> filler;
  filler.key(value.key);
  filler.string(filler.sample.group, value.group, "name of the group");
  filler.sample.at = put(value.at);
  filler.sample.period_ns = static_cast<std::uint64_t>(value.period.count());
  filler.sample.wanted_ns = static_cast<std::uint64_t>(value.wanted.count());
  filler.sample.replayed = value.replayed;
  auto plain = filler.result();
  if (!plain) {
    return tl::unexpected(plain.error());
  }
  auto values = ValueList::encode(value.values);
  if (!values) {
    return tl::unexpected(values.error());
  }
  DataSampleSample sample;
  static_cast<millrace_DataSample&>(sample) = *plain;
  sample.value_list = std::move(*values);
  lend(sample.values, sample.value_list.samples());
  return sample;
}

DataSample Codec<DataSample>::decode(const millrace_DataSample& sample) {
  DataSample value{
      .key = get_key(sample),
      .group = sample.group,
      .at = get(sample.at),
      .period = std::chrono::nanoseconds(sample.period_ns),
      .wanted = std::chrono::nanoseconds(sample.wanted_ns),
      .replayed = sample.replayed,
  };
  for (const millrace_Value& one : elements_of(sample.values)) {
    value.values.push_back(decode_value(one));
  }
  return value;
}

Encoded<millrace_ProgramEvent> Codec<ProgramEvent>::encode(const ProgramEvent& value) {
  Filler<millrace_ProgramEvent> filler;
  filler.key(value.key);
  filler.string(filler.sample.detail, value.detail, "detail");
  filler.sample.kind = convert<millrace_ProgramEventKind>(value.kind);
  filler.sample.at = put(value.at);
  filler.sample.started = put(value.started);
  filler.sample.program = borrow_bytes<millrace_ValueText>(value.program);
  filler.sample.error = value.error;
  filler.sample.has_parts = value.parts.has_value();
  filler.sample.parts = value.parts.value_or(0);
  filler.sample.mode = value.mode;
  filler.sample.replayed = value.replayed;
  return filler.result();
}

ProgramEvent Codec<ProgramEvent>::decode(const millrace_ProgramEvent& sample) {
  return {
      .key = get_key(sample),
      .kind = convert<ProgramEventKind>(sample.kind),
      .at = get(sample.at),
      .started = get(sample.started),
      .program = get_text(sample.program),
      .error = sample.error,
      .parts = sample.has_parts ? std::optional<std::int64_t>(sample.parts) : std::nullopt,
      .mode = sample.mode,
      .detail = sample.detail,
      .replayed = sample.replayed,
  };
}

}  // namespace millrace::fabric::wire
