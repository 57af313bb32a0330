// The services of a batch configuration on the fabric.
//
//   Host host(options, log);
//   host.serve(scripts);      // now, and again whenever they change
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
  /// How to join the fabric, and the version, come from `base`; the rest from each script.
  Host(sdk::ServiceOptions base, base::program::Log log);
  /// Leaves, once the calls under way are answered.
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Serves these scripts, as far as their programs are there, instead of the earlier ones. A
  /// service that is not wanted any more finishes the calls it has. A script that cannot be put on
  /// the fabric is left out and logged.
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
