#include "tests/simulation/values/value_store.hpp"

#include <algorithm>

#include "cnc/ads/bytes.hpp"
#include "fabric/cases.hpp"

namespace millrace::tests::simulation {

namespace {

using gateway::data::Sampler;
namespace data = gateway::data;
namespace variables = gateway::variables;
using gateway::machines::Answer;
using gateway::machines::Question;

cnc::variables::Bytes bytes_of(std::int32_t value) {
  cnc::variables::Bytes bytes;
  for (unsigned byte = 0; byte < sizeof(value); ++byte) {
    bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint32_t>(value) >> (8 * byte)));
  }
  return bytes;
}

Answer answer_to(const Question& question) {
  Answer made;
  made.requester = question.requester;
  made.number = question.number;
  made.requests = 1;
  return made;
}

}  // namespace

std::optional<std::int32_t> ValueStore::value_of(const std::string& name) const {
  if (name == "V.E.TIME") {
    return static_cast<std::int32_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(agenda_.now()).count());
  }
  return name == "V.E.NUMBER" ? std::optional(number_) : std::nullopt;
}

void ValueStore::on_answer_arrived(Time made) {
  constexpr std::size_t most = 1000;
  arrivals_.push_back({agenda_.now(), agenda_.now() - made});
  if (arrivals_.size() > most) {
    arrivals_.pop_front();
  }
}

Time ValueStore::longest_way_since(Time then) const {
  Time longest{};
  for (auto value = arrivals_.rbegin(); value != arrivals_.rend() && value->at >= then; ++value) {
    longest = std::max(longest, value->way);
  }
  return longest;
}

Answer ValueStore::answer(const Question& question) {
  Answer made = answer_to(question);
  if (const auto* look_up = std::get_if<data::Resolve>(&question.step)) {
    std::vector<Sampler::Resolved> all;
    for (const std::string& name : look_up->names) {
      if (!value_of(name)) {
        all.emplace_back(tl::unexpected(cnc::variables::LookupError{
            cnc::ads::ErrorCode::symbol_not_found, "0x710 symbol not found"}));
        continue;
      }
      cnc::variables::Reading reading;
      reading.length = reading.size = sizeof(std::int32_t);
      reading.type = {cnc::variables::Type::sgn32, sizeof(std::int32_t)};
      reading.input = {name.begin(), name.end()};
      reading.access = cnc::variables::Access::read_write;
      all.emplace_back(std::move(reading));
    }
    made.found = std::move(all);
  } else if (const auto* read = std::get_if<data::Read>(&question.step)) {
    std::vector<Sampler::Answer> all;
    for (const cnc::variables::Reading& reading : read->readings) {
      all.emplace_back(bytes_of(*value_of({reading.input.begin(), reading.input.end()})));
    }
    made.found = std::move(all);
  } else if (const auto* write = std::get_if<variables::WriteOne>(&question.step)) {
    std::uint32_t value = 0;
    for (std::size_t byte = 0; byte < write->value.size(); ++byte) {
      value |= static_cast<std::uint32_t>(write->value[byte]) << (8 * byte);
    }
    number_ = static_cast<std::int32_t>(value);
    ++written_[number_];
    made.found = cnc::ads::Result<void>{};
  } else {
    made.found = cnc::ads::Result<variables::Page>(variables::Page{});
  }
  return made;
}

Answer ValueStore::failure(const Question& question, cnc::ads::ErrorCode code) {
  Answer made = answer_to(question);
  if (const auto* look_up = std::get_if<data::Resolve>(&question.step)) {
    made.found = std::vector<Sampler::Resolved>(
        look_up->names.size(), tl::unexpected(cnc::variables::LookupError{code, "no answer"}));
  } else if (const auto* read = std::get_if<data::Read>(&question.step)) {
    made.found =
        std::vector<Sampler::Answer>(read->readings.size(), Sampler::Answer(tl::unexpected(code)));
  } else if (std::holds_alternative<variables::WriteOne>(question.step)) {
    made.found = cnc::ads::Result<void>(tl::unexpected(code));
  } else {
    made.found = cnc::ads::Result<variables::Page>(tl::unexpected(code));
  }
  return made;
}

}  // namespace millrace::tests::simulation
