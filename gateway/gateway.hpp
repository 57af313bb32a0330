// The running gateway: carries out what the core decides, on one io_context.
//
//   Attention attention;
//   Gateway gateway(io.get_executor(), attention, settings, log);   // joins the fabric
//   gateway.start();                                       // begins to connect to the machines
//   attention.run(io, [] { return false; });
#pragma once

#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "gateway/attention.hpp"
#include "gateway/settings.hpp"
#include "idl/program/log.hpp"

namespace millrace::gateway {

class Gateway {
 public:
  /// Throws std::runtime_error if the fabric cannot be joined or the journal not be used.
  Gateway(const boost::asio::any_io_executor& executor, Attention& attention,
          const Settings& settings, idl::program::Log log);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  /// Takes over machines and policies; calls under way go on as they were accepted. The journal and
  /// the fabric stay until the gateway is started anew.
  void change(const Settings& settings);
  /// Takes no new call and calls `finished` once every answer at hand is written: at once, or after
  /// two seconds at the latest.
  void finish(std::function<void()> finished);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::gateway
