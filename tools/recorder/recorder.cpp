#include "tools/recorder/recorder.hpp"

#include "tools/print/recording_report.hpp"

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

namespace {

/// The end of a call, after which `Sync::call` forces data to the disk.
bool ends_a_call(const recording::Entry& entry) {
  const auto* event = std::get_if<fabric::Event>(&entry.sample);
  return event != nullptr && event->kind == fabric::EventKind::written;
}

}  // namespace

Recorder::Recorder(Options options, FreeSpace free_space)
    : options_(std::move(options)),
      free_space_(std::move(free_space)),
      series_(options_.file, has_many_files() ? Series::Files::many : Series::Files::one,
              options_.prefix),
      file_number_(series_.last_number()) {
  if (options_.window) {
    ring_.emplace(options_.window->length, options_.window->size);
  }
}

Recorder::Result Recorder::start(Moment now) {
  if (has_many_files()) {
    check_disk();
    waits_for_room_ = disk_is_full_;
  }
  return ring_ || waits_for_room_ ? Result{} : unless_full(begin_file(now), now);
}

Recorder::Result Recorder::on_entry(recording::Entry entry, Moment now) {
  return unless_full(keep(std::move(entry), now), now);
}

Recorder::Result Recorder::tick(Moment now) {
  return unless_full(do_what_is_due(now), now);
}

Recorder::Result Recorder::unless_full(Result result, Moment now) {
  if (result) {
    return result;
  }
  check_disk();
  if (disk_is_full_ && (file_ || has_many_files())) {
    waits_for_room_ = has_many_files();
    return {};
  }
  // Files may have been removed for it.
  return file_ ? go_on(now) : result;
}

Recorder::Result Recorder::go_on(Moment now) {
  if (file_ && !file_->is_ending()) {
    return close_chunk(options_.sync != Sync::none);
  }
  return (file_ ? end_file({}) : Result{}).and_then([&] {
    return ring_ ? Result{} : begin_file(now);
  });
}

Recorder::Result Recorder::keep(recording::Entry entry, Moment now) {
  ++tally_.received;
  const bool wanted = options_.filter.takes(entry);
  completeness_.add(entry, wanted);
  if (!wanted) {
    ++tally_.filtered;
    return {};
  }
  const bool failure = recording::is_failure(entry);
  if (options_.without_text.contains(entry.uuid)) {
    recording::withhold_text(entry);
  }
  tally_.failures += failure ? 1 : 0;
  if (!ring_ || (file_ && now < write_until_)) {
    return write(entry, now);
  }
  ring_->add(std::move(entry));
  return failure ? write_window(now) : Result{};
}

Recorder::Result Recorder::write_window(Moment now) {
  if (!ring_ || !options_.window || waits_for_room_) {
    return {};
  }
  write_until_ = now + options_.window->after;
  Result result = file_ ? Result{} : begin_file(now);
  ring_->take([&](const recording::Entry& entry) {
    if (result) {
      result = write(entry, now);
    }
  });
  return result.and_then([&] { return close_chunk(options_.sync != Sync::none); });
}

Recorder::Result Recorder::write(const recording::Entry& entry, Moment now) {
  if (waits_for_room_) {
    return {};
  }
  if (!dirty_since_) {
    dirty_since_ = now;
  }
  if (auto written = file_->write(entry); !written) {
    return written;
  }
  if (recording::is_failure(entry) && now >= write_until_) {
    return close_chunk(options_.sync != Sync::none);
  }
  if (options_.sync == Sync::call && ends_a_call(entry)) {
    return close_chunk(true);
  }
  return rotate_if_due(now);
}

Recorder::Result Recorder::do_what_is_due(Moment now) {
  if (waits_for_room_ || !file_) {
    return waits_for_room_ ? wait_for_room(now) : Result{};
  }
  if (dirty_since_ && now - *dirty_since_ >= options_.chunk_period) {
    if (auto closed = close_chunk(options_.sync != Sync::none); !closed) {
      return closed;
    }
  }
  check_disk();
  if (disk_is_full_ && has_many_files()) {
    return wait_for_room(now);
  }
  return rotate_if_due(now);
}

Recorder::Result Recorder::wait_for_room(Moment now) {
  check_disk();
  if (disk_is_full_ == waits_for_room_) {
    return {};
  }
  waits_for_room_ = disk_is_full_;
  if (waits_for_room_) {
    return file_ ? end_file({}) : Result{};
  }
  return go_on(now);
}

Recorder::Result Recorder::close_chunk(bool sync) {
  dirty_since_.reset();
  return file_->close_chunk(sync);
}

Recorder::Result Recorder::finish(std::uint64_t delivered, std::uint64_t lost, fabric::Time now) {
  completeness_.finish(now);
  if (!file_) {
    return {};
  }
  return end_file({{"delivered_by_the_bus", std::to_string(delivered)},
                   {"lost_by_the_bus", std::to_string(lost)},
                   {"filtered_out", std::to_string(tally_.filtered)}});
}

Recorder::Result Recorder::begin_file(Moment now) {
  ++file_number_;
  const auto path = series_.numbered(file_number_);
  auto file = RecordingFile::create(
      path, {.library = options_.library, .compression = options_.compression});
  if (!file) {
    return tl::unexpected(file.error());
  }
  file_ = std::move(*file);
  file_begun_ = now;
  for (const AttachedFile& attachment : options_.attachments) {
    if (auto attached = file_->attach(attachment); !attached) {
      return attached;
    }
  }
  // The header is on the disk before the first call is.
  return file_->close_chunk(options_.sync != Sync::none);
}

Recorder::Result Recorder::end_file(const std::map<std::string, std::string>& more) {
  std::map<std::string, std::string> metadata = options_.labels;
  metadata.insert(more.begin(), more.end());
  metadata["written"] = std::to_string(file_->messages());
  // In a file that others follow: so far.
  for (const auto& [name, count] : print::missing_counts(missing())) {
    metadata[std::string(name)] = std::to_string(count);
  }
  metadata["file"] = std::to_string(file_number_);
  dirty_since_.reset();
  if (auto finished = file_->finish(metadata); !finished) {
    return finished;
  }
  files_.push_back(file_->path());
  written_ += file_->messages();
  file_.reset();
  keep_to_size();
  return {};
}

Recorder::Result Recorder::rotate_if_due(Moment now) {
  const bool too_large = options_.rotate_size > 0 && file_->size() >= options_.rotate_size;
  const bool too_old =
      options_.rotate_time.count() > 0 && now - file_begun_ >= options_.rotate_time;
  // An idle fabric makes no empty files.
  if ((!too_large && !too_old) || file_->messages() == 0) {
    return {};
  }
  return end_file({}).and_then([&] { return begin_file(now); });
}

void Recorder::make_room(const std::function<bool()>& too_much) {
  const std::vector<std::filesystem::path> closed = series_.closed();
  for (std::size_t i = 0; i + 1 < closed.size() && too_much(); ++i) {
    std::error_code failed;
    if (std::filesystem::remove(closed[i], failed)) {
      removed_.push_back(closed[i]);
    }
  }
}

void Recorder::keep_to_size() {
  if (options_.keep_size == 0) {
    return;
  }
  const auto too_large = [&] {
    std::uint64_t sum = 0;
    for (const std::filesystem::path& file : series_.closed()) {
      std::error_code gone;
      const std::uint64_t size = std::filesystem::file_size(file, gone);
      sum += gone ? 0 : size;
    }
    return sum > options_.keep_size;
  };
  make_room(too_large);
}

void Recorder::check_disk() {
  const auto too_full = [&] {
    free_ = free_space_(file_ ? file_->path() : options_.file);
    return *free_ < options_.minimum_free;
  };
  if (too_full() && options_.keep_size > 0) {
    make_room(too_full);
  }
  disk_is_full_ = too_full();
}

Tally Recorder::tally() const {
  Tally tally = tally_;
  tally.written = written_ + (file_ ? file_->messages_taken() : 0);
  tally.let_go = tally.received - tally.filtered - tally.written;
  return tally;
}

std::uint64_t Recorder::disk_space(const std::filesystem::path& path) {
  std::error_code error;
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  return error ? 0 : space.available;
}

}  // namespace millrace::tools::recorder
