#include "gateway/variables/variable_cache.hpp"

#include "cnc/ads/error.hpp"
#include "gateway/data/group.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::variables {

namespace {

using cnc::ads::ErrorCode;
using fabric::Quality;

void fail(VariableCacheEntry& one, ErrorCode code, const fabric::Message& reason, Moment now) {
  one.result.error = ads_number(code);
  one.result.value.quality = is_refusal(code) ? Quality::refused : Quality::stale;
  one.result.value.reason = reason;
  one.result.value.elements = {};
  one.at = now.steady;
}

}  // namespace

VariableCacheEntry& VariableCache::of(std::uint16_t channel, const std::string& name) {
  if (all_.size() >= most) {
    std::erase_if(all_, [](const auto& one) { return one.second.users == 0; });
  }
  const auto [found, is_new] = all_.try_emplace({channel, name});
  if (is_new) {
    found->second.result.value.name = name;
  }
  return found->second;
}

void VariableCache::on_resolved(VariableCacheEntry& one, const Found& found, Moment now) {
  if (!found) {
    fail(one, found.error().code, found.error().reason, now);
    return;
  }
  one.reading = *found;
  one.is_new = true;
  one.result.error = 0;
  one.result.writable = found->access == cnc::variables::Access::read_write;
  one.result.size = found->size;
  one.result.dimensions = found->dimensions;
  one.result.value.type = data::type_of(*found);
  one.result.value.is_array = found->is_array;
}

void VariableCache::on_read(VariableCacheEntry& one, const Answered& answer, Moment now) {
  if (!one.reading) {
    return;
  }
  if (!answer) {
    if (is_refusal(answer.error())) {
      one.reading.reset();
      if (!one.is_new) {
        return;
      }
    }
    fail(one, answer.error(), describe(answer.error()), now);
    return;
  }
  one.is_new = false;
  auto elements = data::elements_of(*one.reading, *answer);
  if (!elements) {
    fail(one, ErrorCode::protocol_error, elements.error(), now);
    return;
  }
  one.result.error = 0;
  one.result.value.elements = std::move(*elements);
  one.result.value.quality = Quality::good;
  one.result.value.reason.clear();
  one.result.value.at = now.wall;
  one.at = now.steady;
}

void VariableCache::forget_values() {
  for (auto& [key, one] : all_) {
    one.at = SteadyTime::min();
  }
}

void VariableCache::forget() {
  std::erase_if(all_, [](const auto& one) { return one.second.users == 0; });
  for (auto& [key, one] : all_) {
    one.reading.reset();
    one.at = SteadyTime::min();
  }
}

}  // namespace millrace::gateway::variables
