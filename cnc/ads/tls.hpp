// TLS 1.2 as TwinCAT does it, over a connected socket.
//
//   const auto context = TlsContext::client(security);
//   auto stream = context->stream(std::move(socket));
//   if (const auto error = co_await stream->handshake(); error) …  // stream->peer().refusal may say more
#pragma once

#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <tl/expected.hpp>

#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"

namespace millrace::cnc::ads {

/// Who is at the other end.
struct TlsPeer {
  /// Of its certificate; empty if it has a pre-shared key instead.
  std::string fingerprint;
  std::string common_name;
  /// Why we have refused it; empty if we have not.
  std::string refusal;
};

class TlsStream : public Stream {
 public:
  /// Before anything is read or written.
  virtual boost::asio::awaitable<boost::system::error_code> handshake() = 0;
  /// What came of the handshake; of its certificate also if that was refused.
  [[nodiscard]] virtual const TlsPeer& peer() const = 0;
};

/// Shared by all streams that are made of it, and kept by them.
class TlsContext {
 public:
  /// Fail with words for people about what is wrong with keys and certificates.
  static tl::expected<TlsContext, std::string> client(const Security& security);
  static tl::expected<TlsContext, std::string> server(const ServerSecurity& security);

  [[nodiscard]] std::unique_ptr<TlsStream> stream(Stream::Socket socket) const;

 private:
  struct Impl;
  explicit TlsContext(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
