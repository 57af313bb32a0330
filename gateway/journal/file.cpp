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

namespace millrace::gateway::journal {

namespace {

namespace asio = boost::asio;

/// Appends on the executor, forces on a thread of its own. When anything fails, the whole journal
/// is written anew once a period until that works: what a disk kept of a failed write is not known.
class File final : public Journal {
 public:
  File(asio::any_io_executor executor, FileOptions options, idl::program::Log log)
      : executor_(std::move(executor)),
        options_(std::move(options)),
        log_(std::move(log)),
        path_(options_.folder / "calls.journal"),
        timer_(executor_) {
    std::filesystem::create_directories(options_.folder);
    lock_ = lock_folder(options_.folder);
    load();
    rewrite();
    tick();
  }

  ~File() override {
    alive_.reset();
    timer_.cancel();
    pool_.join();
  }

  [[nodiscard]] const Ledger& ledger() const override { return ledger_; }

  void append(const Entry& entry, std::function<void()> recorded) override {
    ledger_.apply(entry);
    if (trouble_.empty()) {
      try {
        const std::string bytes = encode(entry);
        write_all(*file_, bytes, path_);
        size_ += bytes.size();
        // A call number must never be given twice, whatever the policy.
        if (options_.sync != Sync::never && std::holds_alternative<Numbers>(entry)) {
          force(*file_, path_);
        }
        dirty_ = true;
      } catch (const std::system_error& error) {
        fail(error.what());
      }
    }
    if (!trouble_.empty() || options_.sync == Sync::always) {
      waiting_.push_back(std::move(recorded));
      start_forcing();
    } else {
      asio::post(executor_, std::move(recorded));
    }
  }

  void on_trouble(std::function<void(const std::string&)> handler) override {
    handler_ = std::move(handler);
  }

 private:
  using Waiting = std::vector<std::function<void()>>;

  void load() {
    const std::string bytes = read_file(path_);
    const Contents contents = decode(bytes);
    if (contents.good == 0 && !contents.damage.empty()) {
      throw std::runtime_error(fmt::format("{}: {}; move it away or choose another journal folder",
                                           path_.string(), contents.damage));
    }
    for (const Entry& entry : contents.entries) {
      ledger_.apply(entry);
    }
    if (!contents.damage.empty()) {
      log_->warn("journal {}: {} at byte {}: the last {} bytes are cut off, as after a crash",
                 path_.string(), contents.damage, contents.good, bytes.size() - contents.good);
    }
    if (ledger_.numbers().epoch == 0) {
      ledger_.apply(Numbers{draw_epoch(), 0});
    }
  }

  void rewrite() {
    std::string bytes(magic);
    for (const Entry& entry : ledger_.snapshot()) {
      bytes += encode(entry);
    }
    replace_file(path_, bytes);
    file_ = std::make_shared<Descriptor>(open_to_append(path_));
    size_ = bytes.size();
    dirty_ = false;
  }

  /// Once a period: forces, shortens, or tries again after trouble.
  void tick() {
    timer_.expires_after(options_.period);
    timer_.async_wait([this, alive = std::weak_ptr(alive_)](boost::system::error_code error) {
      if (error || alive.expired()) {
        return;
      }
      if (!trouble_.empty()) {
        recover();
      } else if (size_ > options_.compact_at) {
        shorten();
      } else if (options_.sync == Sync::interval) {
        start_forcing();
      }
      tick();
    });
  }

  void recover() {
    try {
      rewrite();
    } catch (const std::exception& error) {
      log_->debug("journal: still {}", error.what());
      return;
    }
    log_->info("journal {} can be written again", path_.string());
    trouble_.clear();
    confirm(std::exchange(waiting_, {}));
    tell();
  }

  void shorten() {
    try {
      rewrite();
      confirm(std::exchange(waiting_, {}));
    } catch (const std::exception& error) {
      fail(error.what());
    }
  }

  void start_forcing() {
    if (forcing_ || !dirty_ || !trouble_.empty()) {
      return;
    }
    forcing_ = true;
    dirty_ = false;
    // Everything appended so far is covered; what comes meanwhile is covered by the next round.
    asio::post(pool_, [this, file = file_, alive = std::weak_ptr(alive_),
                       batch = std::exchange(waiting_, {})]() mutable {
      std::string failure;
      try {
        force(*file, path_);
      } catch (const std::system_error& error) {
        failure = error.what();
      }
      asio::post(executor_, [this, alive, failure, batch = std::move(batch)]() mutable {
        if (!alive.expired()) {
          forced(failure, std::move(batch));
        }
      });
    });
  }

  void forced(const std::string& failure, Waiting batch) {
    forcing_ = false;
    if (failure.empty()) {
      confirm(std::move(batch));
      if (options_.sync == Sync::always) {
        start_forcing();
      }
      return;
    }
    batch.insert(batch.end(), std::make_move_iterator(waiting_.begin()),
                 std::make_move_iterator(waiting_.end()));
    waiting_ = std::move(batch);
    fail(failure);
  }

  void confirm(Waiting batch) {
    for (std::function<void()>& recorded : batch) {
      asio::post(executor_, std::move(recorded));
    }
  }

  void fail(const std::string& reason) {
    if (trouble_.empty()) {
      trouble_ =
          fmt::format("the journal {}; no new call is taken until it can be written", reason);
      log_->error("{}", trouble_);
      tell();
    }
  }

  void tell() {
    if (handler_) {
      asio::post(executor_, [handler = handler_, trouble = trouble_] { handler(trouble); });
    }
  }

  asio::any_io_executor executor_;
  FileOptions options_;
  idl::program::Log log_;
  std::filesystem::path path_;
  Descriptor lock_;
  std::shared_ptr<Descriptor> file_;
  Ledger ledger_;
  std::size_t size_ = 0;
  bool dirty_ = false;
  bool forcing_ = false;
  Waiting waiting_;
  std::string trouble_;
  std::function<void(const std::string&)> handler_;
  asio::steady_timer timer_;
  /// Handlers that outlive the journal see it gone.
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
  asio::thread_pool pool_{1};
};

}  // namespace

std::unique_ptr<Journal> open_file(asio::any_io_executor executor, FileOptions options,
                                   idl::program::Log log) {
  return std::make_unique<File>(std::move(executor), std::move(options), std::move(log));
}

}  // namespace millrace::gateway::journal
