// The services of a batch configuration on the fabric.
//
//   Host host(options, log);
//   host.serve(scripts);      // now, and again after each change
#pragma once

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/program/log.hpp"
#include "services/batch/answering.hpp"
#include "services/batch/script.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::batch {

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

}  // namespace millrace::services::batch
