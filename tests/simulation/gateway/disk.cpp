#include "tests/simulation/gateway/disk.hpp"

#include <algorithm>
#include <utility>

#include "gateway/journal/format.hpp"

namespace millrace::tests::simulation {

namespace journal = gateway::journal;

namespace {

const std::string no_space = "cannot be written: No space left on device";
const std::string broken = "cannot be forced to the disk: Input/output error";

}  // namespace

bool Disk::cut_power() {
  if (before_ && random_.chance(50)) {
    named_ = before_;
  }
  before_.reset();
  File& file = *named_;
  if (file.forced >= file.bytes.size()) {
    return false;
  }
  const std::size_t kept = file.forced + random_.below(file.bytes.size() - file.forced);
  file.bytes.resize(kept);
  if (kept > file.forced && random_.chance(30)) {
    // A block that was allocated but not written.
    std::fill(file.bytes.begin() +
                  static_cast<std::ptrdiff_t>(file.forced + random_.below(kept - file.forced)),
              file.bytes.end(), '\0');
  }
  file.forced = file.bytes.size();
  return true;
}

void Disk::wipe() {
  named_ = std::make_shared<File>();
  before_.reset();
}

tl::expected<void, std::string> Disk::begin(std::string_view bytes) {
  if (full) {
    return tl::unexpected(no_space);
  }
  named_ = std::make_shared<File>(File{std::string(bytes), bytes.size()});
  before_.reset();
  file_ = named_;
  return {};
}

tl::expected<void, std::string> Disk::append(File& file, std::string_view bytes) {
  if (full) {
    file.bytes += bytes.substr(0, random_.below(bytes.size()));
    return tl::unexpected(no_space);
  }
  file.bytes += bytes;
  return {};
}

tl::expected<void, std::string> Disk::append(std::string_view bytes) {
  return append(*file_, bytes);
}

tl::expected<void, std::string> Disk::append_to_new_file(std::string_view bytes) {
  if (bug_ == Bug::draft_not_kept_up) {
    return {};
  }
  return append(*new_file_, bytes);
}

std::string Disk::force(File& file, std::size_t upto) {
  file.forced = std::max(file.forced, upto);
  return full && random_.chance(20) ? broken : "";
}

void Disk::start_force() {
  process_.after(a_while(), [this, file = file_, upto = file_->bytes.size()] {
    writer->on_forced(force(*file, upto));
  });
}

void Disk::start_new_file(std::vector<gateway::JournalEntry> entries) {
  process_.after(a_while(), [this, entries = std::move(entries)] {
    new_file_ = std::make_shared<File>();
    const std::string bytes = journal::encode_file(entries);
    writer->on_new_file(append(*new_file_, bytes).map([&] { return bytes.size(); }));
  });
}

void Disk::start_replace() {
  // Bytes that arrive during a force may or may not be covered.
  process_.after(a_while(), [this, upto = new_file_->bytes.size()] {
    if (const std::string failure = force(*new_file_, upto); !failure.empty()) {
      writer->on_replaced(failure);
      return;
    }
    process_.after(a_while(), [this] {
      before_ = std::exchange(named_, new_file_);
      process_.after(a_while(), [this] {
        if (full && random_.chance(20)) {
          writer->on_replaced(broken);
          return;
        }
        before_.reset();
        file_ = new_file_;
        writer->on_replaced("");
      });
    });
  });
}

void Disk::confirm(std::vector<gateway::Ticket> tickets) {
  for (auto& confirmed : tickets) {
    process_.after(
        Time{}, [this, ticket = std::move(confirmed)] { on_recorded(ticket); }, 1);
  }
}

void Disk::report_error(const fabric::Message& error) {
  process_.after(Time{}, [this, error] { on_write_error(error); });
}

}  // namespace millrace::tests::simulation
