#include "services/mail/smtp.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <sys/socket.h>

#include "base/curl/easy.hpp"

namespace millrace::services::mail {

namespace {

using base::curl::Easy;
using base::curl::set;

/// Until a mail server accepts the connection.
constexpr std::chrono::milliseconds connect_timeout{10'000};
/// "235 2.7.0 Authentication successful" (RFC 4954, 6).
constexpr int code_logged_in = 235;
/// The reply to QUIT, which libcurl sends after a refusal, too (RFC 5321, 4.2.3).
constexpr int code_closing = 221;

/// One attempt, for libcurl's callbacks. Their exceptions must not pass through libcurl: they end
/// the transfer, and are rethrown after it.
struct Session {
  const Mail& mail;
  const Transport::Watch& watch;
  bool needs_login = false;
  std::size_t sent = 0;
  bool logged_in = false;
  Exchange exchange{};
  std::exception_ptr failure{};
};

template <typename Result, typename Work>
Result guarded(Session& session, Result abort, const Work& work) noexcept {
  try {
    return work();
  } catch (...) {
    session.failure = std::current_exception();
    return abort;
  }
}

/// Handles a line of the server. The last line of a reply has a blank after its code (RFC 5321,
/// 4.2).
void hear(Session& session, std::string_view line) {
  while (line.ends_with('\n') || line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  constexpr std::size_t digits = 3;
  if (line.size() < digits || !std::all_of(line.begin(), line.begin() + digits,
                                           [](char c) { return c >= '0' && c <= '9'; })) {
    return;
  }
  const int code = (line[0] - '0') * 100 + (line[1] - '0') * 10 + (line[2] - '0');
  if (code == code_closing) {
    return;
  }
  session.exchange.code = code;
  session.exchange.reply = line;
  session.exchange.replied_after = session.exchange.handed_over;
  session.logged_in = session.logged_in || code == code_logged_in;
}

std::size_t on_line(char* data, std::size_t size, std::size_t count, void* user) noexcept {
  Session& session = *static_cast<Session*>(user);
  // Any value but the size of the line ends the transfer.
  return guarded(session, std::size_t{0}, [&] {
    hear(session, {data, size * count});
    return size * count;
  });
}

/// Passes the message to libcurl piece by piece; asks the watch before the last piece.
std::size_t read(Session& session, char* buffer, std::size_t room) {
  const std::string_view rest = std::string_view(session.mail.message).substr(session.sent);
  const std::size_t piece = std::min(room, rest.size());
  if (session.needs_login && !session.logged_in) {
    session.exchange.trouble = ConnectionError::login;
    session.exchange.trouble_text = "it offers no supported login method";
    return CURL_READFUNC_ABORT;
  }
  if (piece == rest.size() && !session.exchange.handed_over) {
    if (session.watch.cancelled() || !session.watch.handing_over()) {
      session.exchange.trouble = ConnectionError::broken;
      session.exchange.trouble_text = "stopped before the mail was handed over";
      return CURL_READFUNC_ABORT;
    }
    session.exchange.handed_over = true;
  }
  rest.copy(buffer, piece);
  session.sent += piece;
  return piece;
}

std::size_t on_read(char* buffer, std::size_t size, std::size_t count, void* user) noexcept {
  Session& session = *static_cast<Session*>(user);
  return guarded(session, std::size_t{CURL_READFUNC_ABORT},
                 [&] { return read(session, buffer, size * count); });
}

int on_progress(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) noexcept {
  Session& session = *static_cast<Session*>(user);
  return guarded(session, 1, [&] {
    return !session.exchange.handed_over && session.watch.cancelled() ? 1 : 0;
  });
}

ConnectionError trouble_of(CURLcode code) {
  switch (code) {
    case CURLE_OK:
      return ConnectionError::none;
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
      return ConnectionError::no_contact;
    case CURLE_OPERATION_TIMEDOUT:
      return ConnectionError::timeout;
    case CURLE_USE_SSL_FAILED:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_SSL_CIPHER:
    case CURLE_SSL_CERTPROBLEM:
    case CURLE_SSL_ISSUER_ERROR:
    case CURLE_SSL_ENGINE_INITFAILED:
      return ConnectionError::tls;
    case CURLE_LOGIN_DENIED:
      return ConnectionError::login;
    default:
      return ConnectionError::broken;
  }
}

base::curl::List recipients(const Mail& mail) {
  std::vector<std::string> to;
  std::ranges::transform(mail.to, std::back_inserter(to),
                         [](const std::string& address) { return fmt::format("<{}>", address); });
  return base::curl::list_of(to);
}

std::string url(const ServerConfig& server) {
  const bool is_v6 = server.host.find(':') != std::string::npos;
  return fmt::format("{4}://{0}{1}{2}:{3}", is_v6 ? "[" : "", server.host, is_v6 ? "]" : "",
                     server.port, server.security == Security::tls ? "smtps" : "smtp");
}

void set_server(const Easy& handle, const ServerConfig& server, const std::string& password) {
  set(handle, CURLOPT_URL, url(server).c_str());
  set(handle, CURLOPT_CONNECTTIMEOUT_MS, connect_timeout);
  set(handle, CURLOPT_TIMEOUT_MS, server.timeout);
  set(handle, CURLOPT_SERVER_RESPONSE_TIMEOUT,
      static_cast<long>(std::chrono::ceil<std::chrono::seconds>(server.timeout).count()));
  set(handle, CURLOPT_USE_SSL,
      long{server.security == Security::none ? CURLUSESSL_NONE : CURLUSESSL_ALL});
  if (!server.ca_file.empty()) {
    set(handle, CURLOPT_CAINFO, server.ca_file.c_str());
    set(handle, CURLOPT_CAPATH, static_cast<const char*>(nullptr));
  }
  if (!server.user.empty()) {
    set(handle, CURLOPT_USERNAME, server.user.c_str());
    set(handle, CURLOPT_PASSWORD, password.c_str());
  }
}

/// libcurl sends QUIT when the handle is destroyed, and waits up to two minutes for the reply.
void do_not_wait_for_goodbye(const Easy& handle) {
  curl_socket_t socket = CURL_SOCKET_BAD;
  if (curl_easy_getinfo(handle.get(), CURLINFO_ACTIVESOCKET, &socket) == CURLE_OK &&
      socket != CURL_SOCKET_BAD) {
    ::shutdown(socket, SHUT_RD);
  }
}

void set_mail(const Easy& handle, Session& session, const std::string& from,
              const base::curl::List& recipients) {
  set(handle, CURLOPT_MAIL_FROM, from.c_str());
  set(handle, CURLOPT_MAIL_RCPT, recipients.get());
  set(handle, CURLOPT_UPLOAD, 1L);
  set(handle, CURLOPT_READFUNCTION, &on_read);
  set(handle, CURLOPT_READDATA, &session);
  set(handle, CURLOPT_HEADERFUNCTION, &on_line);
  set(handle, CURLOPT_HEADERDATA, &session);
  set(handle, CURLOPT_XFERINFOFUNCTION, &on_progress);
  set(handle, CURLOPT_XFERINFODATA, &session);
  set(handle, CURLOPT_NOPROGRESS, 0L);
}

}  // namespace

Smtp::Smtp(ServerConfig server) : server_(std::move(server)) {}

Smtp::~Smtp() {
  if (began_) {
    curl_global_cleanup();
  }
}

void Smtp::begin() {
  // Deferred to the first mail, because TLS takes several MiB that a service without mails does not
  // need.
  const std::lock_guard guard(lock_);
  if (began_) {
    return;
  }
  if (const CURLcode code = curl_global_init(CURL_GLOBAL_DEFAULT); code != CURLE_OK) {
    throw std::runtime_error(fmt::format("libcurl cannot be used: {}", curl_easy_strerror(code)));
  }
  began_ = true;
}

Outcome Smtp::send(const Mail& mail, const Watch& watch) {
  const auto secret = password(server_);
  if (!secret) {
    return {.verdict = Verdict::login, .reply = secret.error()};
  }
  begin();
  const Easy handle = base::curl::make_easy();
  Session session{.mail = mail, .watch = watch, .needs_login = !server_.user.empty()};
  std::array<char, CURL_ERROR_SIZE> reason{};
  const base::curl::List to = recipients(mail);
  const std::string from = fmt::format("<{}>", mail.from);
  set(handle, CURLOPT_ERRORBUFFER, reason.data());
  set_server(handle, server_, *secret);
  set_mail(handle, session, from, to);
  const CURLcode code = curl_easy_perform(handle.get());
  do_not_wait_for_goodbye(handle);
  if (session.failure) {
    std::rethrow_exception(session.failure);
  }
  if (session.exchange.trouble == ConnectionError::none) {
    session.exchange.trouble = trouble_of(code);
    session.exchange.trouble_text = reason[0] != '\0' ? reason.data() : curl_easy_strerror(code);
  }
  return outcome_of(session.exchange);
}

}  // namespace millrace::services::mail
