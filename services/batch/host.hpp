// The services of a batch configuration on the fabric.
//
//   Host host(options, log);
//   host.serve(scripts);      // now, and again after each change
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/program/log.hpp"
#include "services/batch/config.hpp"
#include "services/sdk/call.hpp"
#include "services/sdk/service.hpp"

namespace CLI {
class App;
}

namespace millrace::services::batch {

// The handler of one script.

/// A script that may be replaced while calls run; each call runs the script that was current when
/// it began.
class CurrentScript {
 public:
  explicit CurrentScript(Script script) : script_(std::move(script)) {}
  [[nodiscard]] Script get() const;
  void set(Script script);

 private:
  mutable std::mutex lock_;
  Script script_;
};

/// Runs the script for each call; a cancelled call ends its process.
sdk::Handler answering(std::shared_ptr<const CurrentScript> script, base::program::Log log);

/// Not thread-safe.
class Host {
 public:
  /// `base` has the fabric and the version; each script has the rest.
  Host(sdk::ServiceOptions base, base::program::Log log);
  /// Leaves the fabric after the running calls are answered.
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Serves these scripts, if their files exist, in place of the earlier ones. A removed service
  /// finishes its calls. A script that cannot be registered is logged and left out.
  void serve(const std::vector<Script>& scripts);

  [[nodiscard]] std::size_t size() const { return services_.size(); }

 private:
  struct Served {
    Script script;
    std::shared_ptr<CurrentScript> current;
    std::unique_ptr<sdk::Service> service;
  };

  void start(const Script& script);
  void stop(const std::string& uuid);

  sdk::ServiceOptions base_;
  base::program::Log log_;
  std::map<std::string, Served> services_;
  /// Services that finish their calls; each thread ends with its service.
  std::vector<std::jthread> leaving_;
};

// millrace-batch --exec: one script, configured on the command line.

/// The command line of every service, and --exec PROGRAM, --time-limit MS, --accept-empty, --cut
/// and --cp1252. Returns an exit code.
int serve_one(int argc, char** argv);

/// Adds those of its flags that `others` does not have, for their help, man page and completion. A
/// command line with one of them and without --exec is refused.
void tell_flags_of_one(CLI::App& others);

}  // namespace millrace::services::batch
