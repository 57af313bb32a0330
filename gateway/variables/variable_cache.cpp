#include "gateway/variables/variable_cache.hpp"

#include "cnc/ads/error.hpp"
#include "gateway/data/group.hpp"

namespace millrace::gateway::variables {

namespace {

using cnc::ads::ErrorCode;
using fabric::Quality;

void fail(VariableCacheEntry& entry, ErrorCode code, const fabric::Message& reason, Moment now) {
  entry.result.error = ads_number(code);
  entry.result.value.quality = is_refusal(code) ? Quality::refused : Quality::stale;
  entry.result.value.reason = reason;
  entry.result.value.elements = {};
  entry.at = now.steady;
}

}  // namespace

std::shared_ptr<VariableCacheEntry> VariableCache::of(std::uint16_t channel,
                                                      const std::string& name) {
  if (all_.size() >= most) {
    forget_unneeded();
  }
  std::shared_ptr<VariableCacheEntry>& entry = all_[{channel, name}];
  if (entry == nullptr) {
    entry = std::make_shared<VariableCacheEntry>();
    entry->result.value.name = name;
  }
  return entry;
}

void VariableCache::forget_unneeded() {
  std::erase_if(all_, [](const auto& entry) { return entry.second.use_count() == 1; });
}

void VariableCache::on_resolved(VariableCacheEntry& entry, const Found& found, Moment now) {
  if (!found) {
    fail(entry, found.error().code, found.error().reason, now);
    return;
  }
  entry.reading = *found;
  entry.is_new = true;
  entry.result.error = 0;
  entry.result.writable = found->access == cnc::variables::Access::read_write;
  entry.result.size = found->size;
  entry.result.dimensions = found->dimensions;
  entry.result.value.type = data::type_of(*found);
  entry.result.value.is_array = found->is_array;
}

void VariableCache::on_read(VariableCacheEntry& entry, const Answered& answer, Moment now) {
  if (!entry.reading) {
    return;
  }
  if (!answer) {
    if (is_refusal(answer.error())) {
      entry.reading.reset();
      if (!entry.is_new) {
        return;
      }
    }
    fail(entry, answer.error(), describe(answer.error()), now);
    return;
  }
  entry.is_new = false;
  auto elements = data::elements_of(*entry.reading, *answer);
  if (!elements) {
    fail(entry, ErrorCode::protocol_error, elements.error(), now);
    return;
  }
  entry.result.error = 0;
  entry.result.value.elements = std::move(*elements);
  entry.result.value.quality = Quality::good;
  entry.result.value.reason.clear();
  entry.result.value.at = now.wall;
  entry.at = now.steady;
}

void VariableCache::forget_values() {
  for (const auto& [key, entry] : all_) {
    entry->at = SteadyTime::min();
  }
}

void VariableCache::forget() {
  forget_unneeded();
  forget_values();
  for (const auto& [key, entry] : all_) {
    entry->reading.reset();
  }
}

}  // namespace millrace::gateway::variables
