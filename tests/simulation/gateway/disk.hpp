// The disk of a gateway: what a crash of the process leaves, what a power cut leaves, and when it
// is full.
#pragma once

#include <functional>
#include <string>

#include "gateway/journal/keeper.hpp"
#include "tests/simulation/time/process.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

class Disk final : public gateway::journal::Storage {
 public:
  Disk(Process& process, Random random) : process_(process), random_(random) {}

  /// What a new process finds.
  [[nodiscard]] const std::string& file() const { return written_; }
  /// What was not forced is lost, all or some of it, and its end is torn. True if something is.
  bool cut_power();
  /// The folder is emptied.
  void wipe();

  bool full = false;
  /// How long a force takes.
  Time slow_least = 100us;
  Time slow_most = 5ms;

  /// Where the journal's answers go in this life of the process.
  std::function<void(const std::string&)> on_forced;
  std::function<void(const std::string&)> on_trouble;

  tl::expected<void, std::string> append(std::string_view bytes) override;
  tl::expected<void, std::string> replace(std::string_view bytes) override;
  void start_force() override;
  void confirm(std::vector<gateway::journal::Recorded> recorded) override;
  void tell(const std::string& trouble) override;

 private:
  Process& process_;
  Random random_;
  std::string written_;
  /// So much of it survives a power cut.
  std::size_t forced_ = 0;
  /// Counts the files.
  std::uint64_t replaced_ = 0;
};

}  // namespace millrace::tests::simulation
