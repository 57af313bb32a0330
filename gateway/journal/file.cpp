#include <cerrno>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/messages/format.hpp"
#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/posix/system.hpp"
#include "gateway/journal/format.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/journal/journal_writer.hpp"

namespace millrace::gateway::journal {

namespace {

// The file operations of the journal; every failure is a std::system_error with the path.

/// Writes all of it.
void write_all(const base::posix::Fd& file, std::string_view bytes,
               const std::filesystem::path& name);

/// Forces the file to the disk.
void force(const base::posix::Fd& file, const std::filesystem::path& name);

/// Begins FILE.new, which is to take the place of `file`, with these bytes; open for appending.
base::posix::Fd begin_new_file(const std::filesystem::path& file, std::string_view bytes);

/// Forces the new file to the disk and replaces `file` with it, atomically even if the power fails.
void replace_file(const base::posix::Fd& new_file, const std::filesystem::path& file);

using base::posix::Fd;

constexpr mode_t readable_by_group = 0640;

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what) {
  throw std::system_error(errno, std::generic_category(),
                          fmt::format("{} cannot be {}", path.string(), what));
}

Fd open_or_fail(const std::filesystem::path& path, int flags, std::string_view what) {
  Fd opened(::open(path.c_str(), flags | O_CLOEXEC, readable_by_group));
  if (!opened) {
    fail(path, what);
  }
  return opened;
}

std::filesystem::path new_name_of(const std::filesystem::path& file) {
  return file.string() + ".new";
}

Fd lock_journal(const std::filesystem::path& folder) {
  return base::posix::lock_folder(folder, "lock",
                                  "another gateway uses this journal folder; end that one, or "
                                  "choose another folder with --journal");
}

/// The whole file; empty if there is none.
std::string read_file(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) {
    return {};
  }
  auto bytes = base::posix::read_regular(file, std::numeric_limits<std::size_t>::max());
  if (!bytes) {
    throw std::runtime_error(fmt::format("{} cannot be read: {}", file.string(), bytes.error()));
  }
  return *std::move(bytes);
}

void write_all(const Fd& file, std::string_view bytes, const std::filesystem::path& name) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(file.get(), bytes.data(), bytes.size());
    if (put < 0 && errno != EINTR) {
      fail(name, "written");
    }
    bytes.remove_prefix(put < 0 ? 0 : static_cast<std::size_t>(put));
  }
}

void force(const Fd& file, const std::filesystem::path& name) {
  if (::fdatasync(file.get()) != 0) {
    fail(name, "forced to the disk");
  }
}

Fd begin_new_file(const std::filesystem::path& file, std::string_view bytes) {
  const std::filesystem::path name = new_name_of(file);
  // What is left over may be a link that leads elsewhere.
  struct stat status {};
  if (::lstat(name.c_str(), &status) == 0 && (S_ISREG(status.st_mode) || S_ISLNK(status.st_mode))) {
    ::unlink(name.c_str());
  }
  Fd new_file = open_or_fail(name, O_WRONLY | O_APPEND | O_CREAT | O_NOFOLLOW, "opened");
  write_all(new_file, bytes, name);
  return new_file;
}

void replace_file(const Fd& new_file, const std::filesystem::path& file) {
  const std::filesystem::path name = new_name_of(file);
  force(new_file, name);
  std::filesystem::rename(name, file);
  const std::filesystem::path parent = file.parent_path();
  const Fd folder = open_or_fail(parent, O_RDONLY | O_DIRECTORY, "opened");
  if (::fsync(folder.get()) != 0) {
    fail(parent, "forced to the disk");
  }
}

namespace asio = boost::asio;

template <typename Do>
tl::expected<void, std::string> attempt(Do todo) {
  try {
    todo();
  } catch (const std::exception& error) {
    return tl::unexpected(std::string(error.what()));
  }
  return {};
}

std::string failure_of(const tl::expected<void, std::string>& done) {
  return done ? std::string() : done.error();
}

/// Appends on the executor; slow disk operations run on a separate thread.
class File final : public Journal, private JournalFile {
 public:
  File(asio::any_io_executor executor, FileOptions options, base::program::Log log)
      : executor_(std::move(executor)),
        options_(std::move(options)),
        log_(std::move(log)),
        path_(options_.folder / "calls.journal"),
        writer_(*this, options_),
        timer_(executor_) {
    std::filesystem::create_directories(options_.folder);
    lock_ = lock_journal(options_.folder);
    load();
    tick();
  }

  ~File() override {
    alive_.reset();
    timer_.cancel();
    pool_.join();
  }

  [[nodiscard]] const JournalState& state() const override { return writer_.state(); }

  void append(const JournalEntry& entry, const Ticket& ticket) override {
    writer_.append(entry, ticket);
  }

  void on_recorded(std::function<void(const Ticket&)> handler) override {
    on_recorded_ = std::move(handler);
  }

  void on_write_error(std::function<void(const fabric::Message&)> handler) override {
    on_write_error_ = std::move(handler);
  }

 private:
  void load() {
    const auto damage = writer_.load(read_file(path_), draw_epoch());
    if (!damage) {
      throw std::runtime_error(fmt::format("{}: {}; move it away or choose another journal folder",
                                           path_.string(), damage.error()));
    }
    if (!damage->empty()) {
      log_->warn("journal {}: {}", path_.string(), *damage);
    }
    if (const auto written = writer_.begin(); !written) {
      throw std::runtime_error(written.error());
    }
  }

  void tick() {
    timer_.expires_after(options_.period);
    timer_.async_wait([this, alive = std::weak_ptr(alive_)](boost::system::error_code error) {
      if (!error && !alive.expired()) {
        writer_.on_tick();
        tick();
      }
    });
  }

  tl::expected<void, std::string> begin(std::string_view bytes) override {
    return attempt([&] {
      file_ = std::make_shared<base::posix::Fd>(begin_new_file(path_, bytes));
      replace_file(*file_, path_);
    });
  }

  tl::expected<void, std::string> append(std::string_view bytes) override {
    return attempt([&] { write_all(*file_, bytes, path_); });
  }

  tl::expected<void, std::string> append_to_new_file(std::string_view bytes) override {
    return attempt([&] { write_all(*new_file_, bytes, path_); });
  }

  void start_force() override {
    on_disk([this, file = file_] { return attempt([&] { force(*file, path_); }); },
            [this](const auto& done) { writer_.on_forced(failure_of(done)); });
  }

  void start_new_file(std::vector<JournalEntry> entries) override {
    on_disk(
        [this, entries = std::move(entries),
         new_file = new_file_ = std::make_shared<base::posix::Fd>()] {
          const std::string bytes = encode_file(entries);
          return attempt([&] { *new_file = begin_new_file(path_, bytes); }).map([&] {
            return bytes.size();
          });
        },
        [this](const auto& length) { writer_.on_new_file(length); });
  }

  void start_replace() override {
    on_disk(
        [this, new_file = new_file_] { return attempt([&] { replace_file(*new_file, path_); }); },
        [this](const auto& done) {
          if (done) {
            // Closing the last descriptor of a file deletes it, which may take a while.
            asio::post(pool_, [old = std::exchange(file_, new_file_)] {});
          }
          writer_.on_replaced(failure_of(done));
        });
  }

  /// Runs `work` on the journal's thread, then calls `then` with its result on the executor.
  template <typename Work, typename Then>
  void on_disk(Work work, Then then) {
    asio::post(pool_, [this, work = std::move(work), then = std::move(then),
                       alive = std::weak_ptr(alive_)]() mutable {
      asio::post(executor_, [done = work(), then = std::move(then), alive = std::move(alive)] {
        if (!alive.expired()) {
          then(done);
        }
      });
    });
  }

  /// Each in a turn of the loop of its own.
  void confirm(std::vector<Ticket> tickets) override {
    for (Ticket& confirmed : tickets) {
      asio::post(executor_, [this, ticket = std::move(confirmed), alive = std::weak_ptr(alive_)] {
        if (!alive.expired()) {
          on_recorded_(ticket);
        }
      });
    }
  }

  void report_error(const fabric::Message& error) override {
    if (error.empty()) {
      log_->info("journal {} is writable again", path_.string());
    } else {
      log_->error("{}", error);
    }
    if (on_write_error_) {
      asio::post(executor_, [handler = on_write_error_, error] { handler(error); });
    }
  }

  asio::any_io_executor executor_;
  FileOptions options_;
  base::program::Log log_;
  std::filesystem::path path_;
  base::posix::Fd lock_;
  std::shared_ptr<base::posix::Fd> file_;
  /// Of the thread until the new file is begun.
  std::shared_ptr<base::posix::Fd> new_file_;
  JournalWriter writer_;
  std::function<void(const Ticket&)> on_recorded_;
  std::function<void(const fabric::Message&)> on_write_error_;
  asio::steady_timer timer_;
  /// Handlers that outlive the journal see it gone.
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
  asio::thread_pool pool_{1};
};

}  // namespace

std::unique_ptr<Journal> open_file(asio::any_io_executor executor, FileOptions options,
                                   base::program::Log log) {
  return std::make_unique<File>(std::move(executor), std::move(options), std::move(log));
}

}  // namespace millrace::gateway::journal
