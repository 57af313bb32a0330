#include "gateway/journal/keeper.hpp"

#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "gateway/journal/format.hpp"

namespace millrace::gateway::journal {

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

tl::expected<void, std::string> Keeper::rewrite() {
  std::string bytes(magic);
  for (const JournalEntry& entry : ledger_.snapshot()) {
    bytes += encode(entry);
  }
  return storage_.replace(bytes).map([&] {
    size_ = bytes.size();
    dirty_ = false;
  });
}

void Keeper::append(const JournalEntry& entry, Recorded recorded) {
  ledger_.apply(entry);
  if (trouble_.empty()) {
    const std::string bytes = encode(entry);
    const auto written = storage_.append(bytes);
    size_ += bytes.size();
    dirty_ = true;
    if (!written) {
      fail(written.error());
    }
  }
  // A call number must never be given twice, whatever the policy.
  const bool forced = options_.sync == Sync::always || std::holds_alternative<NumbersEntry>(entry);
  if (forced || !trouble_.empty()) {
    waiting_.push_back(std::move(recorded));
    start_forcing();
  } else if (recorded) {
    storage_.confirm({std::move(recorded)});
  }
}

void Keeper::on_tick() {
  if (!trouble_.empty()) {
    recover();
  } else if (size_ > options_.compact_at) {
    shorten();
  } else if (options_.sync == Sync::interval) {
    start_forcing();
  }
}

void Keeper::recover() {
  if (!rewrite()) {
    return;
  }
  trouble_.clear();
  storage_.confirm(std::exchange(waiting_, {}));
  storage_.tell("");
}

void Keeper::shorten() {
  if (const auto rewritten = rewrite()) {
    storage_.confirm(std::exchange(waiting_, {}));
  } else {
    fail(rewritten.error());
  }
}

void Keeper::start_forcing() {
  if (forcing_ || !dirty_ || !trouble_.empty()) {
    return;
  }
  forcing_ = true;
  dirty_ = false;
  // Everything appended so far is covered; what comes meanwhile is covered by the next round.
  batch_ = std::exchange(waiting_, {});
  storage_.start_force();
}

void Keeper::on_forced(const std::string& failure) {
  forcing_ = false;
  auto batch = std::exchange(batch_, {});
  if (failure.empty()) {
    storage_.confirm(std::move(batch));
    if (!waiting_.empty()) {
      start_forcing();
    }
    return;
  }
  batch.insert(batch.end(), std::make_move_iterator(waiting_.begin()),
               std::make_move_iterator(waiting_.end()));
  waiting_ = std::move(batch);
  fail(failure);
}

void Keeper::fail(const std::string& reason) {
  if (trouble_.empty()) {
    trouble_ = fmt::format("the journal {}; no new call is taken until it can be written", reason);
    storage_.tell(trouble_);
  }
}

}  // namespace millrace::gateway::journal
