// A plant for a scenario: a virtual CNC whose channels call a service all the time, a gateway, and
// services, each on a host of its own.
//
//   Plant plant(Backend::namespaces);
//   plant.service("service-1", "slow-1", {"--work", "20"});
//   plant.gateway();
//   plant.cnc({.channels = 2, .calls = 100});
//   plant.hosts().network().cut("service-1");
//   …
//   plant.expect_all_answered();
#pragma once

#include <chrono>
#include <filesystem>
#include <ios>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/cluster/driver/hosts.hpp"
#include "tests/cluster/history/verdict.hpp"
#include "tests/support/trust_credentials.hpp"

namespace millrace::tests::cluster {

using Flags = std::vector<std::string>;

/// The UUID of millrace-slow-service.
inline constexpr const char* slow_uuid = "c0ffee00-0000-4000-8000-000000000001";

/// What the virtual CNC does: in each channel a program that calls the service so many times, each
/// call as soon as the last is answered, and looks whether the answer is its own.
struct Load {
  std::uint32_t channels = 1;
  std::uint32_t calls = 1;
  std::string uuid = slow_uuid;
  /// A file of tests/data/nc/cluster.
  std::string program = "counting.nc";
};

class Plant {
 public:
  /// Hosts gateway, recorder, controller, service-1 to service-4. Every program joins the fabric by
  /// the profile deploy/profiles/one_network.fabric.textproto unless told otherwise, with
  /// unprotected: true in the place of its trust.
  explicit Plant(Backend backend);

  Hosts& hosts() { return *hosts_; }
  Network& network() { return hosts_->network(); }

  /// From now on each program shows what it is, as its name says: gateway, service, or operator and
  /// recorder.
  void with_trust();
  /// From now on programs on `host` join by this file of deploy/profiles, or of the hosts' folder.
  void set_profile(const std::string& host, const std::string& file);
  /// The fabric is recorded on `host` rather than on the host "recorder".
  void record_on(const std::string& host) { recorder_host_ = host; }

  /// Started and ready. A second one takes the place of the first, which must have ended.
  Task& cnc(const Load& load);
  /// Started and ready, with its journal. A recorder is started before the first one.
  Task& gateway(const Flags& flags = {});
  /// millrace-slow-service under a name of its own, started and ready. The name stands for the
  /// process: a service that is started anew needs another one.
  Task& service(const std::string& host, const std::string& name, const Flags& flags = {});
  /// So many of them at once, all ready.
  void services(const std::string& host, const std::vector<std::string>& names,
                const Flags& flags = {});
  /// Any other program that joins the fabric, by its name among the programs of this build.
  Task& start(const std::string& host, const std::string& name, const std::string& program,
              Flags flags = {});
  /// The operator's command on a host, to its end: what it printed. `exit_code` is that of success
  /// unless the test expects another.
  std::string millrace(const std::string& host, Flags flags, int exit_code = 0);
  Task& task(const std::string& name) { return *tasks_.at(name); }

  /// Waits until all programs of the CNC have ended, then stops the gateway and the recorder, and
  /// fails the test for a program that did not get its own answers, for a recording that is not
  /// whole (I7), and for each violated invariant.
  void expect_all_answered(std::chrono::milliseconds timeout = patience);

  /// How many calls services have finished so far.
  [[nodiscard]] std::size_t finished() const;
  /// Waits until that many more are finished, and returns how long it took.
  std::chrono::duration<double> await_finished(std::size_t more,
                                               std::chrono::milliseconds timeout = patience);
  /// A recorder in the place of one that was killed.
  void record_again();

  /// What has been written down so far; the recording once the recorder has ended.
  [[nodiscard]] History history() const;
  /// The file of the recorder.
  [[nodiscard]] std::filesystem::path recording() const { return hosts_->folder() / "run.mcap"; }
  /// What all programs have written, for a test that failed.
  [[nodiscard]] std::string logs() const;

 private:
  /// That of the gateway; empty before it begins one.
  [[nodiscard]] std::vector<gateway::JournalEntry> journal() const;
  Task& run(const std::string& host, const std::string& name, const std::string& program,
            const Flags& flags);
  void record();
  void end_recording();
  [[nodiscard]] Flags joining(const std::string& host, const std::string& program) const;
  [[nodiscard]] Flags of_service(const std::string& host, const std::string& name,
                                 const Flags& flags) const;
  [[nodiscard]] std::string write_program(const Load& load) const;

  std::unique_ptr<Hosts> hosts_;
  std::optional<TrustCredentials> trust_;
  /// By host.
  std::map<std::string, std::string> profiles_;
  std::map<std::string, std::unique_ptr<Task>> tasks_;
  std::string recorder_host_ = "recorder";
  /// Of the CNC that was started last.
  Load load_;
  /// The calls that ended in journals of gateways before the one that was started last.
  std::set<std::string> ended_before_;
  /// How far the executions have been counted, and what came of it.
  mutable std::streamoff counted_to_ = 0;
  mutable std::size_t finished_ = 0;
};

}  // namespace millrace::tests::cluster
