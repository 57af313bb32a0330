#include "cnc/ads/link_words.hpp"

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

std::string peer(const ClientOptions& options) {
  return fmt::format("{}:{}", options.host, options.tcp_port);
}

std::string no_ads(const ClientOptions& options, const std::string& detail) {
  return fmt::format("{} breaks the ADS protocol: {}: is this the port of an ADS router?",
                     peer(options), detail);
}

}  // namespace

LinkError explain_end(const ClientOptions& options, const LinkEnd& end) {
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, no_ads(options, end.detail)};
  }
  if (end.cause == LinkEnd::Cause::silent) {
    return {ErrorCode::timeout,
            fmt::format("{} has not answered {}: connection given up", peer(options), end.detail)};
  }
  return {ErrorCode::link_lost,
          fmt::format(
              "{} closed the connection ({}): was it restarted, or is there another ADS client on "
              "this host? A controller keeps one connection to each address, the newest",
              peer(options), end.detail)};
}

LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address) {
  const auto source = options.source.net_id.to_string();
  const auto target = options.target.to_string();
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, no_ads(options, end.detail)};
  }
  switch (answer) {
    case ErrorCode::link_lost:
      if (end.cause == LinkEnd::Cause::closed_by_us) {
        return explain_no_connection(options, "closed while connecting");
      }
      return {
          answer,
          fmt::format("route missing: {} closed the connection before the first answer; it needs "
                      "a route from NetId {} to {}",
                      peer(options), source, local_address)};
    case ErrorCode::timeout:
      return {
          answer,
          fmt::format("{} accepted the connection but does not answer: is {} its NetId, and does "
                      "its route from NetId {} lead to {}?",
                      peer(options), target, source, local_address)};
    case ErrorCode::target_port_not_found:
      return {answer,
              fmt::format("{} answers, but nothing serves its AMS port {}: does the CNC run?",
                          peer(options), options.probe_port)};
    case ErrorCode::target_machine_not_found:
      return {answer,
              fmt::format(
                  "{} answers, but does not know NetId {}: is the NetId of the controller right?",
                  peer(options), target)};
    default:
      return {answer,
              fmt::format("{} does not report its state: {}", peer(options), describe(answer))};
  }
}

LinkError explain_no_connection(const ClientOptions& options, const std::string& reason) {
  return {ErrorCode::link_down, fmt::format("{}: {}", peer(options), reason)};
}

}  // namespace millrace::cnc::ads
