#include "gateway/journal/keeper.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "gateway/journal/format.hpp"

namespace millrace::gateway::journal {

namespace {

/// A file that is so many times as long as the open calls need is written anew: what that costs
/// stays in proportion to what was appended, however many calls are open.
constexpr std::size_t growth = 2;

}  // namespace

Keeper::Keeper(Storage& storage, FileOptions options)
    : storage_(storage), options_(std::move(options)) {}

tl::expected<std::string, std::string> Keeper::load(std::string_view bytes,
                                                    std::uint64_t new_epoch) {
  const Contents contents = decode(bytes);
  if (contents.good == 0 && !contents.damage.empty()) {
    return tl::unexpected(contents.damage);
  }
  for (const JournalEntry& entry : contents.entries) {
    ledger_.apply(entry);
  }
  if (ledger_.numbers().epoch == 0) {
    ledger_.apply(NumbersEntry{new_epoch, 0});
  }
  if (contents.damage.empty()) {
    return std::string();
  }
  return fmt::format("{} at byte {}: the last {} bytes are cut off, as after a crash",
                     contents.damage, contents.good, bytes.size() - contents.good);
}

tl::expected<void, std::string> Keeper::begin() {
  const std::string bytes = encode_file(ledger_.snapshot());
  return storage_.begin(bytes).map([&] {
    size_ = bytes.size();
    fit(size_);
  });
}

void Keeper::append(const JournalEntry& entry, const Ticket& ticket) {
  ledger_.apply(entry);
  write(encode(entry));
  // A call number must never be given twice, whatever the policy.
  const bool forced = options_.sync == Sync::always || std::holds_alternative<NumbersEntry>(entry);
  if (forced || !trouble_.empty()) {
    force_due_ = true;
    if (ticket) {
      waiting_.push_back(ticket);
    }
    proceed();
  } else if (ticket) {
    storage_.confirm({ticket});
  }
}

/// In trouble only a draft holds what comes: the next one is begun with it.
void Keeper::write(const std::string& bytes) {
  if (trouble_.empty()) {
    size_ += bytes.size();
    dirty_ = true;
    if (const auto written = storage_.append(bytes); !written) {
      fail(written.error());
    }
  }
  if (job_ == Job::draft) {
    tail_ += bytes;
  } else if (job_ == Job::exchange) {
    dirty_ = true;
    write_to_draft(bytes);
  }
}

void Keeper::write_to_draft(const std::string& bytes) {
  draft_size_ += bytes.size();
  if (const auto written = storage_.append_to_draft(bytes); !written) {
    spoiled_ = true;
    fail(written.error());
  }
}

void Keeper::on_tick() {
  draft_due_ = !trouble_.empty() || size_ > limit_;
  force_due_ = force_due_ || options_.sync == Sync::interval;
  proceed();
}

void Keeper::proceed() {
  if (job_ != Job::none) {
    return;
  }
  if (draft_due_) {
    start_draft();
  } else if (trouble_.empty() && force_due_ && dirty_) {
    start_force();
  }
}

void Keeper::start_force() {
  job_ = Job::force;
  cover();
  storage_.start_force();
}

void Keeper::on_forced(const std::string& failure) {
  assert(job_ == Job::force);
  job_ = Job::none;
  if (failure.empty()) {
    storage_.confirm(std::exchange(batch_, {}));
  } else {
    uncover();
    fail(failure);
  }
  proceed();
}

void Keeper::start_draft() {
  job_ = Job::draft;
  draft_due_ = false;
  spoiled_ = false;
  storage_.start_draft(ledger_.snapshot());
}

void Keeper::on_drafted(const tl::expected<std::size_t, std::string>& length) {
  assert(job_ == Job::draft);
  job_ = Job::none;
  const std::string tail = std::exchange(tail_, {});
  if (!length) {
    fail(length.error());
  } else {
    draft_needs_ = *length;
    draft_size_ = *length;
    if (!tail.empty()) {
      write_to_draft(tail);
    }
    if (!spoiled_) {
      start_exchange();
    }
  }
  proceed();
}

void Keeper::start_exchange() {
  job_ = Job::exchange;
  cover();
  storage_.start_exchange();
}

void Keeper::on_exchanged(const std::string& failure) {
  assert(job_ == Job::exchange);
  job_ = Job::none;
  if (!failure.empty()) {
    fail(failure);
  }
  if (!failure.empty() || spoiled_) {
    uncover();
  } else {
    size_ = draft_size_;
    fit(draft_needs_);
    if (!trouble_.empty()) {
      trouble_.clear();
      storage_.tell("");
    }
    storage_.confirm(std::exchange(batch_, {}));
  }
  proceed();
}

/// Everything appended so far is covered by what is started now; what comes meanwhile is covered by
/// the next round.
void Keeper::cover() {
  dirty_ = false;
  force_due_ = false;
  batch_ = std::exchange(waiting_, {});
}

/// It was not.
void Keeper::uncover() {
  batch_.insert(batch_.end(), std::make_move_iterator(waiting_.begin()),
                std::make_move_iterator(waiting_.end()));
  waiting_ = std::exchange(batch_, {});
}

void Keeper::fit(std::size_t needed) {
  limit_ = std::max(options_.compact_at, growth * needed);
}

void Keeper::fail(const std::string& reason) {
  if (trouble_.empty()) {
    trouble_ = fmt::format("the journal {}; no new call is taken until it can be written", reason);
    storage_.tell(trouble_);
  }
}

}  // namespace millrace::gateway::journal
