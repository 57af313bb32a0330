#include "tools/recorder/ring.hpp"

namespace millrace::tools::recorder {

namespace {

/// Roughly: the entry itself and its longest strings.
std::uint64_t memory_of(const recording::Entry& entry) {
  const std::string* text = recording::text_of(entry);
  return sizeof(recording::Entry) + entry.uuid.capacity() +
         (text != nullptr ? text->capacity() : 0);
}

}  // namespace

void Ring::add(recording::Entry entry) {
  const fabric::Time oldest = entry.at - length_;
  used_ += memory_of(entry);
  entries_.push_back(std::move(entry));
  while (entries_.front().at < oldest) {
    drop_oldest();
  }
  while (used_ > size_ && entries_.size() > 1) {
    ++crowded_out_;
    drop_oldest();
  }
}

void Ring::take(const std::function<void(const recording::Entry&)>& use) {
  for (const recording::Entry& entry : entries_) {
    use(entry);
  }
  entries_.clear();
  used_ = 0;
}

void Ring::drop_oldest() {
  used_ -= memory_of(entries_.front());
  entries_.pop_front();
}

}  // namespace millrace::tools::recorder
