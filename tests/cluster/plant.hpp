// A plant for a scenario: a virtual CNC whose channels call a service all the time, a gateway, and
// services, each on its own host.
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

/// The programs of the virtual CNC: each channel makes this many calls, each as soon as the
/// previous one is answered, and checks that the answer is its own.
struct Load {
  std::uint32_t channels = 1;
  std::uint32_t calls = 1;
  std::string uuid = slow_uuid;
  /// A file of tests/data/nc/cluster.
  std::string program = "counting.nc";
};

class Plant {
 public:
  /// Hosts gateway, recorder, controller, service-1 to service-4. By default programs join the
  /// fabric with the profile deploy/profiles/one_network.fabric.textproto, with unprotected: true
  /// in place of its trust.
  explicit Plant(Backend backend);

  Hosts& hosts() { return *hosts_; }
  Network& network() { return hosts_->network(); }

  /// From now on the fabric has trust, with an identity for each program by its name: gateway,
  /// service, or operator and recorder.
  void with_trust();
  /// From now on programs on `host` use this profile from deploy/profiles, or from the hosts'
  /// folder.
  void set_profile(const std::string& host, const std::string& file);
  /// The recorder runs on `host` instead of the host "recorder".
  void record_on(const std::string& host) { recorder_host_ = host; }

  /// Starts it and waits until it is ready. A second one replaces the first, which must have ended.
  Task& cnc(const Load& load);
  /// Starts it with its journal and waits until it is ready. The first call starts a recorder
  /// before.
  Task& gateway(const Flags& flags = {});
  /// Starts a millrace-slow-service with this name and waits until it is ready. The name stands for
  /// the process: a restarted service needs a new one.
  Task& service(const std::string& host, const std::string& name, const Flags& flags = {});
  /// Starts several of them at once and waits until all are ready.
  void services(const std::string& host, const std::vector<std::string>& names,
                const Flags& flags = {});
  /// Starts another program of this build that joins the fabric.
  Task& start(const std::string& host, const std::string& name, const std::string& program,
              Flags flags = {});
  /// Runs the operator's command on a host to its end and returns its output. The test fails for
  /// another exit code.
  std::string millrace(const std::string& host, Flags flags, int exit_code = 0);
  Task& task(const std::string& name) { return *tasks_.at(name); }

  /// Waits until all programs of the CNC have ended, then stops the gateway and the recorder. The
  /// test fails for a program that did not get its own answers, for an incomplete recording (I7),
  /// and for each violated invariant.
  void expect_all_answered(std::chrono::milliseconds timeout = patience);

  /// The number of calls that services have finished so far.
  [[nodiscard]] std::size_t finished() const;
  /// Waits until that many more are finished, and returns the duration.
  std::chrono::duration<double> await_finished(std::size_t more,
                                               std::chrono::milliseconds timeout = patience);
  /// Starts a recorder in place of a killed one.
  void record_again();

  /// The records so far; the recording once the recorder has ended.
  [[nodiscard]] History history() const;
  /// The file of the recorder.
  [[nodiscard]] std::filesystem::path recording() const { return hosts_->folder() / "run.mcap"; }
  /// The output of all programs, for a failed test.
  [[nodiscard]] std::string logs() const;

 private:
  /// The gateway's journal; empty before it begins one.
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
  /// Of the last CNC.
  Load load_;
  /// Ended calls in the journals of earlier gateways.
  std::set<std::string> ended_before_;
  /// The position up to which executions were counted, and the result.
  mutable std::streamoff counted_to_ = 0;
  mutable std::size_t finished_ = 0;
};

}  // namespace millrace::tests::cluster
