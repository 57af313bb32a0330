#include "services/archiver/closed_segment.hpp"

#include <SQLiteCpp/SQLiteCpp.h>

namespace millrace::services::archiver {

struct ClosedSegment::Impl {
  explicit Impl(const std::filesystem::path& file)
      : database(file.string(), SQLite::OPEN_READONLY),
        find(database, "SELECT id FROM put WHERE call = ?") {}

  SQLite::Database database;
  SQLite::Statement find;
};

ClosedSegment::ClosedSegment(const std::filesystem::path& file)
    : impl_(std::make_unique<Impl>(file)) {}
ClosedSegment::~ClosedSegment() = default;
ClosedSegment::ClosedSegment(ClosedSegment&&) noexcept = default;
ClosedSegment& ClosedSegment::operator=(ClosedSegment&&) noexcept = default;

std::optional<std::int64_t> ClosedSegment::find(fabric::CallId call) {
  SQLite::Statement& find = impl_->find;
  find.reset();
  find.bind(1, call.to_string());
  const bool found = find.executeStep();
  const auto id = found ? std::optional(find.getColumn(0).getInt64()) : std::nullopt;
  find.reset();
  return id;
}

fabric::Time ClosedSegment::ended() const {
  const std::int64_t ended = impl_->database.execAndGet("SELECT ended FROM archive").getInt64();
  return fabric::Time(std::chrono::nanoseconds(ended));
}

}  // namespace millrace::services::archiver
