#include "gateway/journal/journal_writer.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/journal/format.hpp"

namespace millrace::gateway::journal {

namespace {

/// A file of more than this multiple of what the open calls need is rewritten: so the cost stays in
/// proportion to what was appended, for any number of open calls.
constexpr std::size_t growth = 2;

}  // namespace

JournalWriter::JournalWriter(JournalFile& file, FileOptions options)
    : file_(file), options_(std::move(options)) {}

tl::expected<std::string, std::string> JournalWriter::load(std::string_view bytes,
                                                           std::uint64_t new_epoch) {
  const Contents contents = decode(bytes);
  if (contents.good == 0 && !contents.damage.empty()) {
    return tl::unexpected(contents.damage);
  }
  for (const JournalEntry& entry : contents.entries) {
    state_.apply(entry);
  }
  if (state_.numbers().epoch == 0) {
    state_.apply(NumbersEntry{new_epoch, 0});
  }
  if (contents.damage.empty()) {
    return std::string();
  }
  return fmt::format("{} at byte {}: the last {} bytes are cut off, as after a crash",
                     contents.damage, contents.good, bytes.size() - contents.good);
}

tl::expected<void, std::string> JournalWriter::begin() {
  const std::string bytes = encode_file(state_.snapshot());
  return file_.begin(bytes).map([&] {
    size_ = bytes.size();
    limit_ = std::max(options_.compact_at, growth * size_);
  });
}

void JournalWriter::append(const JournalEntry& entry, const Ticket& ticket) {
  state_.apply(entry);
  write(encode(entry));
  // A call number must never be given twice, whatever the policy.
  const bool forced = options_.sync == Sync::always || std::holds_alternative<NumbersEntry>(entry);
  if (forced || !error_.empty()) {
    force_due_ = true;
    if (ticket) {
      waiting_.push_back(ticket);
    }
    proceed();
  } else if (ticket) {
    file_.confirm({ticket});
  }
}

/// After a failure only a new file holds what comes: the next one is begun with it.
void JournalWriter::write(const std::string& bytes) {
  if (error_.empty()) {
    size_ += bytes.size();
    dirty_ = true;
    if (const auto written = file_.append(bytes); !written) {
      fail(written.error());
    }
  }
  if (auto* const rewriting = std::get_if<Rewriting>(&job_)) {
    rewriting->tail += bytes;
  } else if (auto* const replacing = std::get_if<Replacing>(&job_)) {
    dirty_ = true;
    replacing->size += bytes.size();
    if (const auto written = file_.append_to_new_file(bytes); !written) {
      replacing->spoiled = true;
      fail(written.error());
    }
  }
}

void JournalWriter::on_tick() {
  new_file_due_ = !error_.empty() || size_ > limit_;
  force_due_ = force_due_ || options_.sync == Sync::interval;
  proceed();
}

void JournalWriter::proceed() {
  if (!std::holds_alternative<std::monostate>(job_)) {
    return;
  }
  if (new_file_due_) {
    new_file_due_ = false;
    job_ = Rewriting{};
    file_.start_new_file(state_.snapshot());
  } else if (error_.empty() && force_due_ && dirty_) {
    job_ = Forcing{take_batch()};
    file_.start_force();
  }
}

void JournalWriter::on_forced(const std::string& failure) {
  auto [batch] = std::get<Forcing>(std::exchange(job_, {}));
  if (failure.empty()) {
    file_.confirm(std::move(batch));
  } else {
    return_batch(std::move(batch));
    fail(failure);
  }
  proceed();
}

void JournalWriter::on_new_file(const tl::expected<std::size_t, std::string>& length) {
  const auto [tail] = std::get<Rewriting>(std::exchange(job_, {}));
  const auto added = length.and_then([&](std::size_t) {
    return tail.empty() ? tl::expected<void, std::string>() : file_.append_to_new_file(tail);
  });
  if (added) {
    job_ = Replacing{.batch = take_batch(), .needed = *length, .size = *length + tail.size()};
    file_.start_replace();
  } else {
    fail(added.error());
  }
  proceed();
}

void JournalWriter::on_replaced(const std::string& failure) {
  auto replaced = std::get<Replacing>(std::exchange(job_, {}));
  if (!failure.empty()) {
    fail(failure);
  }
  if (!failure.empty() || replaced.spoiled) {
    return_batch(std::move(replaced.batch));
  } else {
    size_ = replaced.size;
    limit_ = std::max(options_.compact_at, growth * replaced.needed);
    if (!error_.empty()) {
      error_.clear();
      file_.report_error({});
    }
    file_.confirm(std::move(replaced.batch));
  }
  proceed();
}

/// Of everything appended so far; later entries are covered by the next batch.
std::vector<Ticket> JournalWriter::take_batch() {
  dirty_ = false;
  force_due_ = false;
  return std::exchange(waiting_, {});
}

/// It was not covered: it waits before the later ones.
void JournalWriter::return_batch(std::vector<Ticket> batch) {
  waiting_.insert(waiting_.begin(), std::make_move_iterator(batch.begin()),
                  std::make_move_iterator(batch.end()));
}

void JournalWriter::fail(const std::string& reason) {
  if (error_.empty()) {
    error_ = base::messages::journal_unwritable(reason);
    file_.report_error(error_);
  }
}

}  // namespace millrace::gateway::journal
