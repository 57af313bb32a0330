// The disk of a gateway: it defines what remains after a crash of the process and after a power
// cut, and it can be full.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/journal/journal_writer.hpp"
#include "tests/simulation/gateway/bug.hpp"
#include "tests/simulation/time/process.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

class Disk final : public gateway::journal::JournalFile {
 public:
  Disk(Process& process, Random random, Bug bug) : process_(process), random_(random), bug_(bug) {}

  /// The file that a new process finds.
  [[nodiscard]] const std::string& file() const { return named_->bytes; }
  /// Loses some or all of what was not forced, and tears the file's end. A name that was not forced
  /// may lead to the previous file. True if something is lost.
  bool cut_power();
  /// Empties the folder.
  void wipe();

  bool full = false;
  /// How long a force takes.
  Time slow_least = 100us;
  Time slow_most = 5ms;

  /// Gets the results for the journal in this run of the process.
  gateway::journal::JournalWriter* writer = nullptr;
  std::function<void(const gateway::Ticket&)> on_recorded;
  std::function<void(const fabric::Message&)> on_write_error;

  tl::expected<void, std::string> begin(std::string_view bytes) override;
  tl::expected<void, std::string> append(std::string_view bytes) override;
  tl::expected<void, std::string> append_to_new_file(std::string_view bytes) override;
  void start_force() override;
  void start_new_file(std::vector<gateway::JournalEntry> entries) override;
  void start_replace() override;
  void confirm(std::vector<gateway::Ticket> tickets) override;
  void report_error(const fabric::Message& error) override;

 private:
  struct File {
    std::string bytes{};
    /// This many bytes survive a power cut.
    std::size_t forced = 0;
  };
  using Opened = std::shared_ptr<File>;

  tl::expected<void, std::string> append(File& file, std::string_view bytes);
  /// The disk may break while it is full.
  std::string force(File& file, std::size_t upto);
  Time a_while() { return random_.between(slow_least, slow_most); }

  Process& process_;
  Random random_;
  Bug bug_;
  /// The file with the journal's name, and the one with that name after a power cut, if different.
  Opened named_ = std::make_shared<File>();
  Opened before_;
  /// The file that this run of the process has opened.
  Opened file_;
  Opened new_file_;
};

}  // namespace millrace::tests::simulation
