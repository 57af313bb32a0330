#include "services/archiver/archive.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/posix/files.hpp"
#include "base/text/ascii.hpp"

namespace millrace::services::archiver {

bool must_rotate(const Policy& policy, fabric::Time begun, std::uintmax_t bytes, fabric::Time now) {
  const bool too_large = policy.rotate_bytes != 0 && bytes >= policy.rotate_bytes;
  const bool too_old = policy.rotate_age.count() != 0 &&
                       (now - begun >= policy.rotate_age || begun - now > policy.rotate_age);
  return too_large || too_old;
}

std::size_t expired(const Policy& policy, const std::vector<Closed>& closed,
                    std::uintmax_t open_bytes, fabric::Time now) {
  std::uintmax_t total =
      std::accumulate(closed.begin(), closed.end(), open_bytes,
                      [](std::uintmax_t sum, const Closed& file) { return sum + file.bytes; });
  std::size_t count = 0;
  while (count + 1 < closed.size()) {
    const Closed& oldest = closed[count];
    const bool too_old =
        policy.keep_age.count() != 0 && oldest.ended && now - *oldest.ended >= policy.keep_age;
    const bool too_large = policy.keep_bytes != 0 && total > policy.keep_bytes;
    if (!too_old && !too_large) {
      break;
    }
    total -= oldest.bytes;
    ++count;
  }
  return count;
}

namespace {

namespace fs = std::filesystem;
using fabric::Time;

constexpr std::string_view name_start = "archive-";
constexpr std::string_view name_end = ".db";
/// Enough for one file per second for 30,000 years.
constexpr std::uint64_t max_number = 999'999'999'999;

/// "archive-000017.db" → 17; nullopt for other files.
std::optional<std::uint64_t> number_of(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(name_start) || !name.ends_with(name_end)) {
    return std::nullopt;
  }
  const std::size_t digits = name.size() - name_start.size() - name_end.size();
  const auto number = base::text::parse_number<std::uint64_t>(
      std::string_view(name).substr(name_start.size(), digits));
  return number && *number <= max_number ? number : std::nullopt;
}

fs::path name_of(const fs::path& folder, std::uint64_t number) {
  return folder / fmt::format("{}{:06}{}", name_start, number, name_end);
}

/// The id after the last put in the damaged `file`, if it can be read.
std::optional<std::int64_t> readable_next_put(const fs::path& file) {
  try {
    // No row of ours has a larger id, even after next_put_without().
    constexpr std::int64_t most = std::int64_t{1} << 53;
    const std::int64_t next = ClosedSegment(file).next_put();
    return next > 0 && next < most ? std::optional(next) : std::nullopt;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

/// An id that no put has, if none can be read: the microseconds since 1970. No archive has had that
/// many puts.
std::int64_t next_put_without(Time now) {
  return std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch()).count();
}

std::optional<Time> written_at(const fs::path& file) {
  std::optional<Time> last;
  for (const std::string& name : {file.string(), file.string() + "-wal"}) {
    struct stat status {};
    if (::stat(name.c_str(), &status) == 0 && status.st_size > 0) {
      const Time time{std::chrono::seconds(status.st_mtim.tv_sec) +
                      std::chrono::nanoseconds(status.st_mtim.tv_nsec)};
      last = last ? std::max(*last, time) : time;
    }
  }
  return last;
}

fs::path made(fs::path folder) {
  fs::create_directories(folder);
  return folder;
}

}  // namespace

std::vector<fs::path> archive_files(const fs::path& folder) {
  std::vector<std::pair<std::uint64_t, fs::path>> numbered;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto number = number_of(entry.path());
    if (number && entry.is_regular_file()) {
      numbered.emplace_back(*number, entry.path());
    }
  }
  std::sort(numbered.begin(), numbered.end());
  std::vector<fs::path> files;
  files.reserve(numbered.size());
  for (auto& [number, file] : numbered) {
    files.push_back(std::move(file));
  }
  return files;
}

Archive::Archive(fs::path folder, const Policy& policy, Time now, Report report)
    : folder_(made(std::move(folder))),
      policy_(policy),
      report_(std::move(report)),
      lock_(base::posix::lock_folder(folder_, "archive.lock",
                                     "another archiver writes into this folder")) {
  open_current(now);
}

void Archive::open_current(Time now) {
  auto files = archive_files(folder_);
  number_ = files.empty() ? 1 : number_of(files.back()).value_or(1);
  if (!files.empty()) {
    last_written_ = written_at(files.back());
    files.pop_back();
  }
  Beginning beginning{.begun = now, .first_put = look_at(files, now)};
  try {
    current_ = std::make_unique<Segment>(file(), beginning);
  } catch (const Foreign& why) {
    leave(file(), why.what());
    if (dynamic_cast<const Damaged*>(&why) != nullptr) {
      const auto next_put = readable_next_put(file());
      beginning.first_put = std::max(beginning.first_put, next_put.value_or(next_put_without(now)));
      // Its calls are known as far as they can be read.
      previous_file_ = next_put ? file() : previous_file_;
    }
    ++number_;
    current_ = std::make_unique<Segment>(file(), beginning);
  }
}

std::int64_t Archive::look_at(const std::vector<fs::path>& older, Time now) {
  std::int64_t next_put = 1;
  fs::path damaged;
  for (const fs::path& file : older) {
    try {
      const ClosedSegment segment(file);
      next_put = std::max(next_put, segment.next_put());
      if (!segment.closed()) {
        unclosed_.push_back(file);
      }
      previous_file_ = file;
      // Its first id is larger than those of the files before.
      damaged.clear();
    } catch (const Damaged& why) {
      leave(file, why.what());
      damaged = file;
    } catch (const std::exception& why) {
      leave(file, why.what());
    }
  }
  if (damaged.empty()) {
    return next_put;
  }
  return std::max(next_put, readable_next_put(damaged).value_or(next_put_without(now)));
}

void Archive::leave(const fs::path& file, const std::string& why) {
  if (foreign_.insert(file).second) {
    report_(fmt::format("{} is damaged or not a file of an archive; it is not changed: {}",
                        file.string(), why));
  }
}

std::vector<std::int64_t> Archive::append(const std::vector<Row>& rows, Time now) {
  try {
    auto ids = append_to_current(rows, now);
    sound_ = true;
    return ids;
  } catch (const Damaged& why) {
    if (!sound_) {
      // The disk damages new files, too: do not create one after the other.
      throw;
    }
    auto next = begin_next(now);
    leave(file(), why.what());
    go_on_in(std::move(next));
    sound_ = false;
  }
  return append(rows, now);
}

std::vector<std::int64_t> Archive::append_to_current(const std::vector<Row>& rows, Time now) {
  if (current_->ended() || must_rotate(policy_, current_->begun(), current_->size(), now)) {
    rotate(now);
  }
  std::vector<std::int64_t> known(rows.size(), 0);
  std::vector<Row> fresh;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* put = std::get_if<Put>(&rows[i]);
    const auto earlier = put != nullptr ? earlier_id(put->call) : std::nullopt;
    if (earlier) {
      known[i] = *earlier;
    } else {
      fresh.push_back(rows[i]);
    }
  }
  const auto added = current_->append(fresh);
  auto next = added.begin();
  for (std::int64_t& id : known) {
    id = id != 0 ? id : *next++;
  }
  return known;
}

std::optional<std::int64_t> Archive::earlier_id(fabric::CallId call) {
  if (previous_file_.empty()) {
    return std::nullopt;
  }
  if (!previous_ && !fs::exists(previous_file_)) {
    // It was moved or removed: a repeated call from it adds a new row, as after its expiry.
    previous_file_.clear();
    return std::nullopt;
  }
  try {
    if (!previous_) {
      previous_.emplace(previous_file_);
    }
    return previous_->find(call);
  } catch (const Foreign& why) {
    leave(previous_file_, why.what());
    previous_.reset();
    previous_file_.clear();
    return std::nullopt;
  }
}

fs::path Archive::file() const {
  return name_of(folder_, number_);
}

void Archive::rotate(Time now) {
  std::unique_ptr<Segment> next;
  try {
    next = begin_next(now);
  } catch (const std::exception& why) {
    if (current_->ended()) {
      throw;
    }
    if (!rotation_failed_) {
      report_(fmt::format("{} cannot be created; {} stays in use and grows: {}",
                          name_of(folder_, number_ + 1).string(), file().string(), why.what()));
    }
    rotation_failed_ = true;
    return;
  }
  // The finished file is closed later, between batches.
  unclosed_.push_back(file());
  go_on_in(std::move(next));
}

std::unique_ptr<Segment> Archive::begin_next(Time now) const {
  if (number_ == max_number) {
    throw std::runtime_error(fmt::format(
        "{} has the highest possible number; move it to another folder", file().string()));
  }
  return std::make_unique<Segment>(name_of(folder_, number_ + 1),
                                   Beginning{.begun = now, .first_put = current_->next_put()});
}

void Archive::go_on_in(std::unique_ptr<Segment> next) {
  previous_.reset();
  previous_file_ = file();
  ++number_;
  current_ = std::move(next);
  begun_a_file_ = true;
  rotation_failed_ = false;
}

void Archive::tidy_up(Time now, Ages ages) {
  close_files(now);
  if (std::exchange(begun_a_file_, false)) {
    remove_expired(now, ages);
  }
}

void Archive::close_files(Time now) {
  std::vector<fs::path> open;
  for (const fs::path& file : std::exchange(unclosed_, {})) {
    if (file == previous_file_) {
      // It is opened again on the next query. SQLite closes a file only without other connections
      // to it.
      previous_.reset();
    }
    try {
      if (!close(file, now)) {
        open.push_back(file);
      }
    } catch (const Foreign& why) {
      leave(file, why.what());
    } catch (const std::exception& why) {
      // Retried later.
      open.push_back(file);
      if (reported_unclosed_.insert(file).second) {
        report_(fmt::format("{} cannot be closed yet: {}", file.string(), why.what()));
      }
    }
  }
  unclosed_ = std::move(open);
}

void Archive::remove_expired(Time now, Ages ages) {
  std::vector<fs::path> files;
  std::vector<Closed> closed;
  for (const fs::path& each : archive_files(folder_)) {
    if (each == file() || foreign_.contains(each)) {
      continue;
    }
    try {
      closed.push_back({.bytes = fs::file_size(each), .ended = ClosedSegment(each).ended()});
      files.push_back(each);
    } catch (const std::exception& why) {
      leave(each, why.what());
    }
  }
  Policy policy = policy_;
  if (ages == Ages::doubted) {
    policy.keep_age = {};
  }
  const std::size_t count = expired(policy, closed, current_->size(), now);
  for (std::size_t i = 0; i < count; ++i) {
    std::error_code failed;
    fs::remove(files[i], failed);
    if (failed) {
      report_(fmt::format("{} cannot be removed: {}", files[i].string(), failed.message()));
      continue;
    }
    // They exist only if another process has read the file until now.
    std::error_code none;
    fs::remove(files[i].string() + "-wal", none);
    fs::remove(files[i].string() + "-shm", none);
    std::erase(unclosed_, files[i]);
  }
}

}  // namespace millrace::services::archiver
