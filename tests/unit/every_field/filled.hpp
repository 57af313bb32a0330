// Values of the fabric in which every field differs from its default, and from the others where its
// type allows.
//
//   const auto request = filled<fabric::Request>();
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "fabric/observer/entry.hpp"
#include "fabric/variables.hpp"

namespace millrace::tests {

class Filler {
 public:
  template <fabric::HasFields Value>
  void fill(Value& value) {
    fabric::for_each_field<Value>([&](const auto& field) {
      auto& member = field.get(value);
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(member)>, std::string>) {
        member = fmt::format("{}{}{}", field.options.cp1252 ? "\xE4" : "", field.name, next());
      } else {
        fill(member);
      }
    });
    fit(value);
  }

 private:
  std::uint16_t next() { return ++last_; }

  void fill(bool& truth) { truth = !truth; }
  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void fill(Number& number) { number = next(); }
  template <typename Enum>
  requires std::is_enum_v<Enum>
  void fill(Enum& word) {
    const int number = static_cast<int>(word);
    word = static_cast<Enum>(number + 1);
    // The default may be the last value.
    if constexpr (requires { name_of(word); }) {
      if (name_of(word).starts_with("unknown")) {
        word = static_cast<Enum>(number - 1);
      }
    }
  }
  void fill(fabric::Time& time) {
    time = fabric::Time(std::chrono::seconds(1'700'000'000 + next()));
  }
  void fill(std::chrono::nanoseconds& time) { time = std::chrono::milliseconds(100 + next()); }
  void fill(std::chrono::milliseconds& time) { time = std::chrono::milliseconds(100 + next()); }
  void fill(std::string& text) { text = fmt::format("text{}", next()); }
  /// With a sentence in it, and one without a code.
  void fill(fabric::Message& message) {
    fabric::Message inner(fmt::format("inner{}", next()));
    inner.code = fmt::format("code{}", next());
    inner.arguments = {fabric::Message(fmt::format("text{}", next()))};
    message = fabric::Message(fmt::format("outer{}", next()));
    message.code = fmt::format("code{}", next());
    message.arguments = {fabric::Message(fmt::format("text{}", next())), inner};
  }
  void fill(fabric::InstanceId& id) { id.bytes.fill(static_cast<std::uint8_t>(next())); }
  void fill(fabric::ChannelScope& scope) { scope = {fmt::format("m{}", next()), next()}; }
  template <typename Number>
  void fill(std::optional<Number>& number) {
    number = next();
  }
  template <typename Element>
  void fill(std::vector<Element>& list) {
    list.resize(3);
    for (Element& element : list) {
      fill(element);
    }
  }
  void fill(fabric::Elements& elements) { elements = std::vector<std::int64_t>{-next(), next()}; }

  /// Makes related fields consistent.
  template <typename Value>
  void fit(Value&) {}
  void fit(fabric::InstanceLoad& load) {
    load.status.waiting = 1;
    load.status.running = static_cast<std::uint32_t>(load.calls.size()) - 1;
  }
  /// Gives each list of values one for each kind of elements.
  void fit(fabric::Value& value) {
    switch (values_++ % 3) {
      case 0:
        value.type = fabric::ValueType::sgn32;
        break;
      case 1:
        value.type = fabric::ValueType::real64;
        value.elements = std::vector<double>{next() + 0.25, -1.5};
        break;
      default:
        value.type = fabric::ValueType::string;
        value.elements = std::vector<std::string>{"\xDF", fmt::format("{}", next()), ""};
    }
  }

  std::uint16_t last_ = 0;
  int values_ = 0;
};

template <typename Value>
Value filled() {
  Value value{};
  Filler().fill(value);
  return value;
}

/// The same without the fields for which `is_left_out(options)` is true.
template <typename Value, typename IsLeftOut>
Value without(Value value, const IsLeftOut& is_left_out) {
  fabric::for_each_field<Value>([&](const auto& field) {
    auto& member = field.get(value);
    using Member = std::remove_cvref_t<decltype(member)>;
    if (is_left_out(field.options)) {
      member = Member{};
    } else if constexpr (fabric::HasFields<Member>) {
      member = without(member, is_left_out);
    }
  });
  return value;
}

inline constexpr fabric::Time recorded_at{std::chrono::seconds(1'700'000'000)};

/// An observer's entry of a sample.
template <typename Value>
fabric::observer::Entry entry_of(Value sample) {
  fabric::observer::Entry entry{.at = recorded_at};
  if constexpr (requires { sample.uuid; }) {
    entry.uuid = sample.uuid;
  } else if constexpr (requires { sample.identity; }) {
    entry.uuid = sample.identity.uuid;
  } else if constexpr (std::is_same_v<Value, fabric::Reply> ||
                       std::is_same_v<Value, fabric::InstanceStatus> ||
                       std::is_same_v<Value, fabric::observer::Withdrawal>) {
    entry.uuid = "service";
  }
  entry.sample = std::move(sample);
  return entry;
}

/// Calls `use` with the sample of each kind, without the fields that observers omit.
template <typename Use>
void for_each_sample(const Use& use) {
  [&]<std::size_t... index>(std::index_sequence<index...>) {
    (use(without(filled<std::variant_alternative_t<index, fabric::observer::Sample>>(),
                 [](const fabric::FieldOptions& options) { return !options.observed; })),
     ...);
  }
  (std::make_index_sequence<std::variant_size_v<fabric::observer::Sample>>());
}

}  // namespace millrace::tests
