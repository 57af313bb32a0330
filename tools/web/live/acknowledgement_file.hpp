// Acknowledgements in a state folder, where they survive a restart of the server.
//
//   AcknowledgementFile file("/var/lib/millrace/web", log);
//   for (const auto& [acknowledgement, at] : file.load()) plant.acknowledge(acknowledgement, at);
//   file.store(plant.acknowledged());
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <tl/expected.hpp>

#include "base/posix/system.hpp"
#include "base/program/log.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::live {

class AcknowledgementFile {
 public:
  /// With their times, the oldest first.
  using List = std::vector<std::pair<plant::Acknowledgement, fabric::Time>>;

  /// Creates a missing folder. Throws std::runtime_error if it cannot be used, or another server
  /// uses it.
  AcknowledgementFile(const std::filesystem::path& folder, base::program::Log log);

  /// Empty without a file. A damaged file is logged, and moved to a name of its own.
  [[nodiscard]] List load() const;
  /// Replaces the file durably; a failure is logged.
  void store(const boost::json::array& acknowledged) const;

 private:
  base::program::Log log_;
  std::filesystem::path file_;
  base::posix::Fd lock_;
};

/// The content of such a file; pure. The error is the reason why it is damaged.
tl::expected<AcknowledgementFile::List, std::string> acknowledgements_in(std::string_view text);

}  // namespace millrace::tools::web::live
