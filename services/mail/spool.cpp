#include "services/mail/spool.hpp"

#include <fstream>
#include <sstream>

#include "base/posix/durable_file.hpp"
#include "base/posix/folder_lock.hpp"
#include "services/mail/spool_file.hpp"

namespace millrace::services::mail {

namespace {

namespace fs = std::filesystem;

fs::path made(fs::path folder) {
  fs::create_directories(folder);
  return folder;
}

tl::expected<Entry, std::string> read_entry(const fs::path& file, fabric::CallId call) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    return tl::unexpected(file.string() + ": cannot be read, or is empty");
  }
  auto entry = from_file(text.str(), file.string());
  if (entry && entry->call != call) {
    return tl::unexpected(file.string() + ": is of call " + entry->call.to_string());
  }
  return entry;
}

}  // namespace

Spool::Spool(fs::path folder)
    : folder_(made(std::move(folder))),
      lock_(base::posix::lock_folder(folder_, "spool.lock",
                                     "another mail service uses this spool")) {}

Spool::Content Spool::read() const {
  Content content;
  for (const auto& file : fs::directory_iterator(folder_)) {
    const auto call = call_of(file.path().filename().string());
    if (!call) {
      continue;
    }
    auto entry = read_entry(file.path(), *call);
    if (!entry) {
      content.mistakes.push_back(entry.error());
      entry = Entry{.call = *call, .stage = Stage::handed_over, .reply = "its file is broken"};
    }
    content.entries.push_back(*std::move(entry));
  }
  return content;
}

tl::expected<void, std::string> Spool::put(const Entry& entry) const {
  return base::posix::write_durably(folder_ / file_name(entry.call), to_file(entry));
}

tl::expected<void, std::string> Spool::remove(fabric::CallId call) const {
  return base::posix::remove_durably(folder_ / file_name(call));
}

}  // namespace millrace::services::mail
