#include <utility>
#include <vector>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <fmt/format.h>

#include "gateway/journal/disk.hpp"
#include "gateway/journal/epoch.hpp"
#include "gateway/journal/format.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/journal/keeper.hpp"

namespace millrace::gateway::journal {

namespace {

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

/// Appends on the executor; what waits for the disk is done on a thread of its own.
class File final : public Journal, private Storage {
 public:
  File(asio::any_io_executor executor, FileOptions options, base::program::Log log)
      : executor_(std::move(executor)),
        options_(std::move(options)),
        log_(std::move(log)),
        path_(options_.folder / "calls.journal"),
        keeper_(*this, options_),
        timer_(executor_) {
    std::filesystem::create_directories(options_.folder);
    lock_ = lock_folder(options_.folder);
    load();
    tick();
  }

  ~File() override {
    alive_.reset();
    timer_.cancel();
    pool_.join();
  }

  [[nodiscard]] const Ledger& ledger() const override { return keeper_.ledger(); }

  void append(const JournalEntry& entry, const Ticket& ticket) override {
    keeper_.append(entry, ticket);
  }

  void on_recorded(std::function<void(const Ticket&)> handler) override {
    on_recorded_ = std::move(handler);
  }

  void on_trouble(std::function<void(const std::string&)> handler) override {
    on_trouble_ = std::move(handler);
  }

 private:
  void load() {
    const auto damage = keeper_.load(read_file(path_), draw_epoch());
    if (!damage) {
      throw std::runtime_error(fmt::format("{}: {}; move it away or choose another journal folder",
                                           path_.string(), damage.error()));
    }
    if (!damage->empty()) {
      log_->warn("journal {}: {}", path_.string(), *damage);
    }
    if (const auto written = keeper_.begin(); !written) {
      throw std::runtime_error(written.error());
    }
  }

  void tick() {
    timer_.expires_after(options_.period);
    timer_.async_wait([this, alive = std::weak_ptr(alive_)](boost::system::error_code error) {
      if (!error && !alive.expired()) {
        keeper_.on_tick();
        tick();
      }
    });
  }

  tl::expected<void, std::string> begin(std::string_view bytes) override {
    return attempt([&] {
      file_ = std::make_shared<base::posix::Fd>(begin_draft(path_, bytes));
      exchange(*file_, path_);
    });
  }

  tl::expected<void, std::string> append(std::string_view bytes) override {
    return attempt([&] { write_all(*file_, bytes, path_); });
  }

  tl::expected<void, std::string> append_to_draft(std::string_view bytes) override {
    return attempt([&] { write_all(*draft_, bytes, path_); });
  }

  void start_force() override {
    on_disk([this, file = file_] { return attempt([&] { force(*file, path_); }); },
            [this](const auto& done) { keeper_.on_forced(failure_of(done)); });
  }

  void start_draft(std::vector<JournalEntry> entries) override {
    on_disk(
        [this, entries = std::move(entries), draft = draft_ = std::make_shared<base::posix::Fd>()] {
          const std::string bytes = encode_file(entries);
          return attempt([&] { *draft = begin_draft(path_, bytes); }).map([&] {
            return bytes.size();
          });
        },
        [this](const auto& length) { keeper_.on_drafted(length); });
  }

  void start_exchange() override {
    on_disk([this, draft = draft_] { return attempt([&] { exchange(*draft, path_); }); },
            [this](const auto& done) {
              if (done) {
                // To close the last descriptor of a file is to delete it, which may take its time.
                asio::post(pool_, [old = std::exchange(file_, draft_)] {});
              }
              keeper_.on_exchanged(failure_of(done));
            });
  }

  /// Does `work` on the journal's thread, then calls `then` with what it returned, on the executor.
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
    for (Ticket& one : tickets) {
      asio::post(executor_, [this, ticket = std::move(one), alive = std::weak_ptr(alive_)] {
        if (!alive.expired()) {
          on_recorded_(ticket);
        }
      });
    }
  }

  void tell(const std::string& trouble) override {
    if (trouble.empty()) {
      log_->info("journal {} can be written again", path_.string());
    } else {
      log_->error("{}", trouble);
    }
    if (on_trouble_) {
      asio::post(executor_, [handler = on_trouble_, trouble] { handler(trouble); });
    }
  }

  asio::any_io_executor executor_;
  FileOptions options_;
  base::program::Log log_;
  std::filesystem::path path_;
  base::posix::Fd lock_;
  std::shared_ptr<base::posix::Fd> file_;
  /// Of the thread until the draft is begun.
  std::shared_ptr<base::posix::Fd> draft_;
  Keeper keeper_;
  std::function<void(const Ticket&)> on_recorded_;
  std::function<void(const std::string&)> on_trouble_;
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
