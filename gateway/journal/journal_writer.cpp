#include "gateway/journal/journal_writer.hpp"

#include <algorithm>
#include <cassert>
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
    set_limit(size_);
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
  if (job_ == Job::new_file) {
    tail_ += bytes;
  } else if (job_ == Job::replace) {
    dirty_ = true;
    write_to_new_file(bytes);
  }
}

void JournalWriter::write_to_new_file(const std::string& bytes) {
  new_file_size_ += bytes.size();
  if (const auto written = file_.append_to_new_file(bytes); !written) {
    spoiled_ = true;
    fail(written.error());
  }
}

void JournalWriter::on_tick() {
  new_file_due_ = !error_.empty() || size_ > limit_;
  force_due_ = force_due_ || options_.sync == Sync::interval;
  proceed();
}

void JournalWriter::proceed() {
  if (job_ != Job::none) {
    return;
  }
  if (new_file_due_) {
    start_new_file();
  } else if (error_.empty() && force_due_ && dirty_) {
    start_force();
  }
}

void JournalWriter::start_force() {
  job_ = Job::force;
  begin_batch();
  file_.start_force();
}

void JournalWriter::on_forced(const std::string& failure) {
  assert(job_ == Job::force);
  job_ = Job::none;
  if (failure.empty()) {
    file_.confirm(std::exchange(batch_, {}));
  } else {
    return_batch();
    fail(failure);
  }
  proceed();
}

void JournalWriter::start_new_file() {
  job_ = Job::new_file;
  new_file_due_ = false;
  spoiled_ = false;
  file_.start_new_file(state_.snapshot());
}

void JournalWriter::on_new_file(const tl::expected<std::size_t, std::string>& length) {
  assert(job_ == Job::new_file);
  job_ = Job::none;
  const std::string tail = std::exchange(tail_, {});
  if (!length) {
    fail(length.error());
  } else {
    new_file_needs_ = *length;
    new_file_size_ = *length;
    if (!tail.empty()) {
      write_to_new_file(tail);
    }
    if (!spoiled_) {
      start_replace();
    }
  }
  proceed();
}

void JournalWriter::start_replace() {
  job_ = Job::replace;
  begin_batch();
  file_.start_replace();
}

void JournalWriter::on_replaced(const std::string& failure) {
  assert(job_ == Job::replace);
  job_ = Job::none;
  if (!failure.empty()) {
    fail(failure);
  }
  if (!failure.empty() || spoiled_) {
    return_batch();
  } else {
    size_ = new_file_size_;
    set_limit(new_file_needs_);
    if (!error_.empty()) {
      error_.clear();
      file_.report_error({});
    }
    file_.confirm(std::exchange(batch_, {}));
  }
  proceed();
}

/// Covers everything appended so far; later entries are covered by the next batch.
void JournalWriter::begin_batch() {
  dirty_ = false;
  force_due_ = false;
  batch_ = std::exchange(waiting_, {});
}

/// It was not.
void JournalWriter::return_batch() {
  batch_.insert(batch_.end(), std::make_move_iterator(waiting_.begin()),
                std::make_move_iterator(waiting_.end()));
  waiting_ = std::exchange(batch_, {});
}

void JournalWriter::set_limit(std::size_t needed) {
  limit_ = std::max(options_.compact_at, growth * needed);
}

void JournalWriter::fail(const std::string& reason) {
  if (error_.empty()) {
    error_ = base::messages::journal_unwritable(reason);
    file_.report_error(error_);
  }
}

}  // namespace millrace::gateway::journal
