#include "services/archiver/archive.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/posix/folder_lock.hpp"
#include "base/text/number.hpp"

namespace millrace::services::archiver {

namespace {

namespace fs = std::filesystem;
using fabric::Time;

constexpr std::string_view name_start = "archive-";
constexpr std::string_view name_end = ".db";

/// "archive-000017.db" → 17; nothing for other files.
std::optional<std::uint64_t> number_of(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(name_start) || !name.ends_with(name_end)) {
    return std::nullopt;
  }
  const std::size_t digits = name.size() - name_start.size() - name_end.size();
  return base::text::parse_number<std::uint64_t>(
      std::string_view(name).substr(name_start.size(), digits));
}

fs::path name_of(const fs::path& folder, std::uint64_t number) {
  return folder / fmt::format("{}{:06}{}", name_start, number, name_end);
}

fs::path made(fs::path folder) {
  fs::create_directories(folder);
  return folder;
}

}  // namespace

std::vector<fs::path> archive_files(const fs::path& folder) {
  std::vector<std::pair<std::uint64_t, fs::path>> numbered;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (const auto number = number_of(entry.path())) {
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

Archive::Archive(fs::path folder, const Policy& policy, Time now)
    : folder_(made(std::move(folder))),
      policy_(policy),
      lock_(base::posix::lock_folder(folder_, "archive.lock", "another archiver writes here")) {
  const auto files = archive_files(folder_);
  number_ = files.empty() ? 1 : number_of(files.back()).value_or(1);
  current_ =
      std::make_unique<Segment>(name_of(folder_, number_), Beginning{.begun = now, .first_put = 1});
  if (files.size() > 1) {
    previous_.emplace(files[files.size() - 2]);
  }
  remove_expired(now);
}

std::vector<std::int64_t> Archive::append(std::vector<Row> rows, Time now) {
  if (current_->ended() || must_rotate(policy_, current_->begun(), current_->size(), now)) {
    rotate(now);
  }
  std::vector<std::int64_t> known(rows.size(), 0);
  std::vector<Row> fresh;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* put = std::get_if<Put>(&rows[i]);
    const auto earlier = put != nullptr && previous_ ? previous_->find(put->call) : std::nullopt;
    if (earlier) {
      known[i] = *earlier;
    } else {
      fresh.push_back(std::move(rows[i]));
    }
  }
  const auto added = current_->append(fresh);
  auto next = added.begin();
  for (std::int64_t& id : known) {
    id = id != 0 ? id : *next++;
  }
  return known;
}

fs::path Archive::file() const {
  return name_of(folder_, number_);
}

void Archive::rotate(Time now) {
  const std::int64_t next_put = current_->next_put();
  current_->end(now);
  current_.reset();
  previous_.emplace(file());
  ++number_;
  current_ = std::make_unique<Segment>(file(), Beginning{.begun = now, .first_put = next_put});
  remove_expired(now);
}

void Archive::remove_expired(Time now) {
  auto files = archive_files(folder_);
  files.pop_back();
  std::vector<Closed> closed;
  closed.reserve(files.size());
  for (const fs::path& file : files) {
    closed.push_back({.bytes = fs::file_size(file), .ended = ClosedSegment(file).ended()});
  }
  const std::size_t count = expired(policy_, closed, current_->size(), now);
  for (std::size_t i = 0; i < count; ++i) {
    fs::remove(files[i]);
  }
}

}  // namespace millrace::services::archiver
