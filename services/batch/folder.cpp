#include "services/batch/folder.hpp"

#include <algorithm>

#include "base/program/command_line.hpp"
#include "services/batch/catalog.hpp"

namespace millrace::services::batch {

namespace {

using Clock = std::chrono::steady_clock;

/// Time between two checks; short enough to notice that a file is still changing.
std::chrono::milliseconds interval(const Config& config) {
  return std::clamp<std::chrono::milliseconds>(config.settle / 4, std::chrono::milliseconds(20),
                                               std::chrono::seconds(1));
}

Config load_or_throw(const std::filesystem::path& file) {
  auto config = load(file);
  if (!config) {
    throw base::program::UsageError(config.error());
  }
  return *std::move(config);
}

}  // namespace

Folder::Folder(std::filesystem::path file, sdk::ServiceOptions base, base::program::Log log)
    : file_(std::move(file)),
      log_(log),
      config_(load_or_throw(file_)),
      settle_(config_.settle, fingerprint(file_, config_.scripts), Clock::now()),
      host_(std::move(base), std::move(log)) {
  host_.serve(config_.scripts);
}

void Folder::follow() {
  std::unique_lock guard(lock_);
  while (!changed_.wait_for(guard, interval(config_), [this] { return stopping_; })) {
    // A check takes time; stop() need not wait for it.
    guard.unlock();
    look();
    guard.lock();
  }
}

void Folder::stop() {
  const std::lock_guard guard(lock_);
  stopping_ = true;
  changed_.notify_one();
}

void Folder::look() {
  if (!settle_.look(fingerprint(file_, config_.scripts), Clock::now())) {
    return;
  }
  auto config = load(file_);
  if (!config) {
    log_->error("{}\nThe services are not changed.", config.error());
    return;
  }
  config_ = *std::move(config);
  settle_ = Settle(config_.settle, fingerprint(file_, config_.scripts), Clock::now());
  host_.serve(config_.scripts);
}

}  // namespace millrace::services::batch
