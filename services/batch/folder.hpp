// Serves a batch.textproto and applies its changes, and those of the scripts in it.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>

#include "base/program/log.hpp"
#include "services/batch/catalog.hpp"
#include "services/batch/config.hpp"
#include "services/batch/host.hpp"

namespace millrace::services::batch {

class Folder {
 public:
  /// Throws program::UsageError with every mistake of the file.
  Folder(std::filesystem::path file, sdk::ServiceOptions base, base::program::Log log);

  /// Returns after stop(). A file with a mistake changes nothing and is logged.
  void follow();
  /// From any thread.
  void stop();

  [[nodiscard]] std::size_t size() const { return host_.size(); }

 private:
  void look();

  std::filesystem::path file_;
  base::program::Log log_;
  Config config_;
  Settle settle_;
  Host host_;
  std::mutex lock_;
  std::condition_variable changed_;
  bool stopping_ = false;
};

}  // namespace millrace::services::batch
