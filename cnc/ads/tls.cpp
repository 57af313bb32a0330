#include "cnc/ads/tls.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <span>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>

#include "base/loop/loop.hpp"
#include "base/messages/catalogue.hpp"
#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
namespace messages = base::messages;
using base::loop::quietly;
using boost::system::error_code;
using messages::Message;

/// The suites that a TwinCAT is known to accept (inferred from kevinherron/beckhoff-secure-ads).
/// The first is the fastest: OpenSSL computes its cipher and its MAC together, which it cannot with
/// SHA-384.
constexpr const char* psk_suites =
    "PSK-AES128-CBC-SHA256:PSK-AES256-CBC-SHA384:PSK-AES256-CBC-SHA:PSK-AES128-CBC-SHA";

std::string in_capitals(std::string_view identity) {
  std::string capitals(identity);
  std::ranges::transform(capitals, capitals.begin(), [](unsigned char c) {
    return static_cast<char>(c < 0x80 ? std::toupper(c) : c);
  });
  return capitals;
}

std::array<std::uint8_t, EVP_MAX_MD_SIZE> sha256(std::string_view text, unsigned int& size) {
  std::array<std::uint8_t, EVP_MAX_MD_SIZE> digest{};
  EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr);
  return digest;
}

/// The suites with certificates.
constexpr const char* certificate_suites =
    "DHE-RSA-AES256-GCM-SHA384:DHE-RSA-AES128-GCM-SHA256:DHE-RSA-AES256-SHA256:"
    "DHE-RSA-AES128-SHA256";

/// Writes the key; returns its size, or 0 if it does not fit.
unsigned int write_key(const Psk& psk, std::span<unsigned char> room) {
  unsigned int size = 0;
  const auto key = sha256(in_capitals(psk.identity) + psk.password, size);
  if (size > room.size()) {
    return 0;
  }
  std::copy_n(key.begin(), size, room.begin());
  return size;
}

}  // namespace

struct TlsContext::Impl {
  explicit Impl(asio::ssl::stream_base::handshake_type the_side)
      : side(the_side),
        context(the_side == asio::ssl::stream_base::client ? asio::ssl::context::tls_client
                                                           : asio::ssl::context::tls_server) {
    SSL_CTX* const native = context.native_handle();
    SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION);
    SSL_CTX_set_max_proto_version(native, TLS1_2_VERSION);
    SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
    // A TwinCAT refuses a ClientHello with the extensions encrypt-then-MAC and extended master
    // secret (inferred, docs/how-to/secure-ads.md).
    SSL_CTX_set_options(native, SSL_OP_NO_TICKET | SSL_OP_NO_ENCRYPT_THEN_MAC |
                                    SSL_OP_NO_EXTENDED_MASTER_SECRET | SSL_OP_NO_RENEGOTIATION |
                                    SSL_OP_NO_COMPRESSION);
    SSL_CTX_set_ex_data(native, index(), this);
  }

  /// Index at which an OpenSSL context stores its Impl.
  static int index() {
    static const int index = SSL_CTX_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
    return index;
  }
  static const Impl& of(const SSL* connection) {
    return *static_cast<const Impl*>(SSL_CTX_get_ex_data(SSL_get_SSL_CTX(connection), index()));
  }

  static unsigned int give_psk(SSL* connection, const char* /*hint*/, char* identity,
                               unsigned int identity_size, unsigned char* key,
                               unsigned int key_size) {
    const Psk& psk = of(connection).psk;
    if (psk.identity.size() >= identity_size) {
      return 0;
    }
    std::memcpy(identity, psk.identity.c_str(), psk.identity.size() + 1);
    return write_key(psk, {key, key_size});
  }

  static unsigned int find_psk(SSL* connection, const char* identity, unsigned char* key,
                               unsigned int key_size) {
    const Psk& psk = of(connection).psk;
    return in_capitals(identity) == in_capitals(psk.identity) ? write_key(psk, {key, key_size}) : 0;
  }

  /// Index at which an OpenSSL connection stores its TlsPeer.
  static int peer_index() {
    static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
    return index;
  }

  /// Replaces OpenSSL's own verification of a certificate and its issuers.
  static int verify(X509_STORE_CTX* chain, void* impl) {
    const auto* const connection = static_cast<const SSL*>(
        X509_STORE_CTX_get_ex_data(chain, SSL_get_ex_data_X509_STORE_CTX_idx()));
    auto& peer = *static_cast<TlsPeer*>(SSL_get_ex_data(connection, peer_index()));
    const X509* const certificate = X509_STORE_CTX_get0_cert(chain);
    peer.fingerprint = base::openssl::fingerprint_of(certificate);
    peer.common_name = base::openssl::common_name_of(certificate);
    const auto& self = *static_cast<const Impl*>(impl);
    if (self.has_ca && X509_verify_cert(chain) != 1) {
      peer.refusal = message_of(X509_STORE_CTX_get_error(chain), certificate);
      return 0;
    }
    peer.refusal = self.why_refused(peer);
    if (!peer.refusal.empty()) {
      X509_STORE_CTX_set_error(chain, X509_V_ERR_APPLICATION_VERIFICATION);
    }
    return peer.refusal.empty() ? 1 : 0;
  }

  static Message message_of(int error, const X509* certificate) {
    const auto until = base::openssl::time_of(X509_get0_notAfter(certificate));
    const std::time_t time = std::chrono::system_clock::to_time_t(until);
    return error == X509_V_ERR_CERT_HAS_EXPIRED
               ? messages::certificate_has_expired(fmt::format("{:%Y-%m-%d}", fmt::gmtime(time)))
               : messages::certificate_of_other_ca(X509_verify_cert_error_string(error));
  }

  [[nodiscard]] Message why_refused(const TlsPeer& peer) const {
    if (fingerprint && peer.fingerprint != *fingerprint) {
      return messages::fingerprint_differs(peer.fingerprint, *fingerprint);
    }
    if (common_name && in_capitals(peer.common_name) != in_capitals(*common_name)) {
      return messages::common_name_differs(peer.common_name, *common_name);
    }
    return {};
  }

  /// Returns the error in the certificate or key; empty if there is none.
  std::string use(const std::string& certificate, const std::string& key) {
    const auto read = base::openssl::Certificate::read(certificate);
    if (!read) {
      return "the certificate " + read.error();
    }
    const auto with = base::openssl::Key::read(key);
    if (!with) {
      return "the key " + with.error();
    }
    if (EVP_PKEY_get_base_id(with->get()) != EVP_PKEY_RSA) {
      return "the key is not an RSA key, and TwinCAT accepts no other kind";
    }
    if (!read->belongs_to(*with)) {
      return "the key does not belong to the certificate";
    }
    SSL_CTX* const native = context.native_handle();
    error_code error;
    context.use_certificate_chain(asio::buffer(certificate), error);
    if (error || SSL_CTX_use_PrivateKey(native, with->get()) != 1) {
      return "the certificate cannot be used: " +
             (error ? error.message() : base::openssl::last_reason());
    }
    SSL_CTX_set_verify(native, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
    SSL_CTX_set_cert_verify_callback(native, &Impl::verify, this);
    return {};
  }

  /// The same, with the CA to which the peer's certificate must lead.
  std::string use(const std::string& ca, const std::string& certificate, const std::string& key) {
    error_code error;
    const auto authority = base::openssl::Certificate::read(ca);
    if (!authority) {
      return "the CA " + authority.error();
    }
    context.add_certificate_authority(asio::buffer(ca), error);
    if (error) {
      return "the CA cannot be used: " + error.message();
    }
    has_ca = true;
    return use(certificate, key);
  }

  asio::ssl::stream_base::handshake_type side;
  asio::ssl::context context;
  Psk psk;
  /// Expected of the peer's certificate; nullopt = checked later.
  std::optional<std::string> fingerprint;
  std::optional<std::string> common_name;
  bool has_ca = false;
};

namespace {

class AsioTlsStream final : public TlsStream {
 public:
  AsioTlsStream(Socket socket, asio::ssl::context& context,
                asio::ssl::stream_base::handshake_type side, int peer_index,
                std::shared_ptr<void> keep)
      : keep_(std::move(keep)),
        stream_(std::move(socket), context),
        side_(side),
        peer_(std::make_unique<TlsPeer>()) {
    SSL_set_ex_data(stream_.native_handle(), peer_index, peer_.get());
  }

  asio::awaitable<error_code> handshake() override {
    const auto [error] = co_await stream_.async_handshake(side_, quietly);
    co_return error;
  }
  asio::awaitable<Moved> read_some(asio::mutable_buffer buffer) override {
    auto [error, size] = co_await stream_.async_read_some(buffer, quietly);
    // That was one record. More may be buffered, and a peer may send each frame in its own record.
    while (!error && size < buffer.size()) {
      auto* const rest = static_cast<std::uint8_t*>(buffer.data()) + size;
      const int more =
          SSL_read(stream_.native_handle(), rest, static_cast<int>(buffer.size() - size));
      if (more <= 0) {
        break;  // the next read reports the error
      }
      size += static_cast<std::size_t>(more);
    }
    co_return Moved{error, size};
  }
  asio::awaitable<Moved> write_some(asio::const_buffer bytes) override {
    return stream_.async_write_some(bytes, quietly);
  }
  void send_now(BytesView bytes) override {
    error_code ignored;
    socket().native_non_blocking(true, ignored);
    socket().non_blocking(true, ignored);
    stream_.write_some(asio::buffer(bytes.data(), bytes.size()), ignored);
  }
  Socket& socket() override { return stream_.next_layer(); }
  [[nodiscard]] const TlsPeer& peer() const override { return *peer_; }

 private:
  std::shared_ptr<void> keep_;
  asio::ssl::stream<Socket> stream_;
  asio::ssl::stream_base::handshake_type side_;
  std::unique_ptr<TlsPeer> peer_;
};

}  // namespace

tl::expected<TlsContext, std::string> TlsContext::client(const Security& security) {
  auto impl = std::make_shared<Impl>(asio::ssl::stream_base::client);
  SSL_CTX* const native = impl->context.native_handle();
  if (const auto* const psk = std::get_if<Psk>(&security)) {
    impl->psk = *psk;
    SSL_CTX_set_cipher_list(native, psk_suites);
    SSL_CTX_set_psk_client_callback(native, &Impl::give_psk);
    return TlsContext(std::move(impl));
  }
  SSL_CTX_set_cipher_list(native, certificate_suites);
  std::string wrong;
  if (const auto* const self_signed = std::get_if<SelfSigned>(&security)) {
    impl->fingerprint = self_signed->fingerprint;
    wrong = impl->use(self_signed->certificate, self_signed->key);
  } else {
    const auto& shared = std::get<SharedCa>(security);
    impl->common_name = shared.common_name;
    wrong = impl->use(shared.ca, shared.certificate, shared.key);
  }
  if (!wrong.empty()) {
    return tl::make_unexpected(wrong);
  }
  return TlsContext(std::move(impl));
}

tl::expected<TlsContext, std::string> TlsContext::server(const ServerSecurity& security) {
  auto impl = std::make_shared<Impl>(asio::ssl::stream_base::server);
  SSL_CTX* const native = impl->context.native_handle();
  std::string suites;
  std::string wrong;
  if (const auto& self_signed = security.self_signed) {
    wrong = impl->use(self_signed->certificate, self_signed->key);
  } else if (const auto& shared = security.shared_ca) {
    wrong = impl->use(shared->ca, shared->certificate, shared->key);
  }
  if (!wrong.empty()) {
    return tl::make_unexpected(wrong);
  }
  if (security.self_signed || security.shared_ca) {
    suites = certificate_suites;
    SSL_CTX_set_dh_auto(native, 1);
  }
  if (security.psk) {
    impl->psk = *security.psk;
    suites += (suites.empty() ? "" : ":") + std::string(psk_suites);
    SSL_CTX_set_psk_server_callback(native, &Impl::find_psk);
  }
  SSL_CTX_set_cipher_list(native, suites.c_str());
  return TlsContext(std::move(impl));
}

std::unique_ptr<TlsStream> TlsContext::stream(Stream::Socket socket) const {
  error_code ignored;  // the handshake reports a closed socket
  socket.set_option(asio::ip::tcp::no_delay(true), ignored);
  return std::make_unique<AsioTlsStream>(std::move(socket), impl_->context, impl_->side,
                                         Impl::peer_index(), impl_);
}

}  // namespace millrace::cnc::ads
