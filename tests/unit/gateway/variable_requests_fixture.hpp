// A controller whose variables are numbers, for tests of variable requests.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/bytes.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace millrace::gateway::variables {

/// A controller whose variables are SGN32 numbers and empty texts, and the time; a test advances
/// both.
class VariableRequestsTest : public testing::Test {
 protected:
  VariableRequestsTest() {
    numbers = {{"V.E.A", 1}, {"V.E.B", 2}, {"V.E.C", 3}};
    begin();
  }

  void begin(VariableSettings settings = {.writable = {{"V.E.*"}}, .requests_per_second = 1000}) {
    sut.emplace("press", std::move(settings));
    sut->on_up({1}, now);
  }

  void pass(std::chrono::nanoseconds time) {
    now.steady += time;
    now.wall += time;
  }

  static fabric::InstanceId id(std::uint8_t number) {
    fabric::InstanceId made;
    made.bytes.fill(number);
    return made;
  }

  fabric::VariableRequest request(std::vector<std::string> names, std::uint8_t requester = 1) {
    fabric::VariableRequest request{
        .requester = id(requester), .key = {"press", 1}, .names = std::move(names)};
    request.token.bytes[0] = static_cast<std::uint8_t>(++tokens & 0xFF);
    request.token.bytes[1] = static_cast<std::uint8_t>(tokens >> 8);
    request.issuer = "she@panel";
    return request;
  }
  fabric::VariableRequest write(std::vector<std::string> names,
                                std::vector<std::vector<std::string>> values) {
    fabric::VariableRequest entry = request(std::move(names));
    entry.action = fabric::VariableAction::write;
    entry.values = std::move(values);
    return entry;
  }

  void ask(const fabric::VariableRequest& request) {
    sut->on_request(request, now);
    keep_news();
  }

  cnc::variables::Reading reading_of(const std::string& name) const {
    cnc::variables::Reading reading;
    const bool text = name.starts_with("V.E.S");
    reading.length = text ? text_size : 4;
    reading.size = reading.length;
    reading.type = {text ? cnc::variables::Type::string : cnc::variables::Type::sgn32,
                    reading.length};
    reading.input = cnc::ads::Bytes(name.begin(), name.end());
    reading.access =
        name == "V.E.C" ? cnc::variables::Access::read_only : cnc::variables::Access::read_write;
    return reading;
  }

  /// Does the next step; false if there is none.
  bool step() {
    auto wanted = sut->next(now);
    if (!wanted) {
      return false;
    }
    pass(round_trip);
    do_it(*wanted);
    keep_news();
    return true;
  }
  void settle() {
    while (step()) {
    }
  }

  void do_it(const Step& wanted) {
    if (const auto* look_up = std::get_if<data::Resolve>(&wanted)) {
      look_ups.push_back(look_up->names);
      std::vector<Found> found;
      for (const std::string& name : look_up->names) {
        found.push_back(numbers.contains(name) ? Found(reading_of(name))
                                               : tl::unexpected(cnc::variables::LookupError{
                                                     cnc::ads::ErrorCode::symbol_not_found,
                                                     "0x710 symbol not found"}));
      }
      sut->on_resolved(found, 2, now);
    } else if (const auto* read = std::get_if<data::Read>(&wanted)) {
      std::vector<std::string> names;
      std::vector<Answered> values;
      for (const cnc::variables::Reading& reading : read->readings) {
        names.emplace_back(reading.input.begin(), reading.input.end());
        if (failure != cnc::ads::ErrorCode::none) {
          values.emplace_back(tl::unexpected(failure));
        } else if (!numbers.contains(names.back())) {
          values.emplace_back(tl::unexpected(cnc::ads::ErrorCode::invalid_handle));
        } else if (names.back().starts_with("V.E.S")) {
          values.emplace_back(cnc::variables::Bytes(text_size));
        } else {
          values.emplace_back(
              cnc::ads::ByteWriter().u32(static_cast<std::uint32_t>(numbers[names.back()])).take());
        }
      }
      reads.push_back(names);
      sut->on_read(values, 1, true, now);
    } else if (const auto* write = std::get_if<WriteOne>(&wanted)) {
      writes.push_back(write->name);
      if (unwritable == write->name) {
        sut->on_written(tl::unexpected(write_error), 1, now);
        return;
      }
      cnc::ads::ByteReader in(write->value);
      numbers[write->name] = static_cast<std::int32_t>(in.u32());
      sut->on_written({}, 1, now);
    } else {
      const auto& list = std::get<ListPage>(wanted);
      pages.push_back(list.first);
      sut->on_listed(Page{2,
                          {{.type = cnc::variables::Type::real64,
                            .size = 8,
                            .dimensions = {},
                            .name = list.family + ".A"}}},
                     2, now);
    }
  }

  void keep_news() {
    Output output = sut->take_output();
    for (auto& answer : output.answers) {
      answers.push_back(std::move(answer));
    }
    for (auto& write : output.written) {
      written.push_back(write);
    }
    for (auto& line : output.lines) {
      lines.push_back(line.text);
    }
  }

  static std::int64_t number_in(const fabric::VariableResult& result) {
    return std::get<std::vector<std::int64_t>>(result.value.elements).at(0);
  }

  std::map<std::string, std::int32_t> numbers;
  /// Of V.E.S…, which are texts.
  std::uint32_t text_size = 256;
  cnc::ads::ErrorCode failure = cnc::ads::ErrorCode::none;
  std::string unwritable;
  cnc::ads::ErrorCode write_error = cnc::ads::ErrorCode::access_denied_index;
  std::chrono::nanoseconds round_trip = std::chrono::microseconds(100);
  Moment now{SteadyTime{} + std::chrono::hours(1), fabric::Time(std::chrono::hours(1))};
  std::uint32_t tokens = 0;
  std::optional<VariableRequests> sut;
  std::vector<std::vector<std::string>> look_ups;
  std::vector<std::vector<std::string>> reads;
  std::vector<std::string> writes;
  std::vector<std::uint32_t> pages;
  std::vector<Output::Answer> answers;
  std::vector<Output::Written> written;
  std::vector<std::string> lines;
};

}  // namespace millrace::gateway::variables
