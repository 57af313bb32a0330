// TLS 1.2 as TwinCAT uses it, over a connected socket.
//
//   const auto context = TlsContext::client(security);
//   auto stream = context->stream(std::move(socket));
//   if (const auto error = co_await stream->handshake(); error) …  // see stream->peer().refusal
#pragma once

#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <tl/expected.hpp>

#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"

namespace millrace::cnc::ads {

/// The identity of the peer.
struct TlsPeer {
  /// Fingerprint of its certificate; empty if it has a pre-shared key instead.
  std::string fingerprint;
  std::string common_name;
  /// Why we refused the peer; empty if we did not.
  base::messages::Message refusal;
};

class TlsStream : public Stream {
 public:
  /// Call it before any read or write.
  virtual boost::asio::awaitable<boost::system::error_code> handshake() = 0;
  /// The result of the handshake; has the certificate's data also if it was refused.
  [[nodiscard]] virtual const TlsPeer& peer() const = 0;
};

/// Shared by all streams made from it; they keep it alive.
class TlsContext {
 public:
  /// Fail with a text for people about the error in the keys and certificates.
  static tl::expected<TlsContext, std::string> client(const Security& security);
  static tl::expected<TlsContext, std::string> server(const ServerSecurity& security);

  [[nodiscard]] std::unique_ptr<TlsStream> stream(Stream::Socket socket) const;

 private:
  struct Impl;
  explicit TlsContext(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
