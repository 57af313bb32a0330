// The running gateway: carries out what the core decides, on one io_context.
//
//   SpinAfterPublish spin;
//   Gateway gateway(io.get_executor(), spin, settings, log);   // joins the fabric
//   gateway.start();                                       // begins to connect to the machines
//   spin.run(io, [] { return false; });
#pragma once

#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "gateway/settings/settings.hpp"
#include "gateway/shell/spin_after_publish.hpp"

namespace millrace::gateway::shell {

class Gateway {
 public:
  /// Throws std::runtime_error if the fabric cannot be joined or the journal not be used.
  Gateway(const boost::asio::any_io_executor& executor, SpinAfterPublish& spin,
          const settings::Settings& settings, base::program::Log log);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  /// Takes over machines and policies; calls under way go on as they were accepted. The journal and
  /// the fabric stay until the gateway is started anew.
  void change(const settings::Settings& settings);
  /// Takes no new call and calls `finished` once every answer at hand is written: at once, or after
  /// two seconds at the latest.
  void finish(std::function<void()> finished);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::gateway::shell
