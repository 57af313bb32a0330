// Login and actions: each action of a user becomes an operator's command on the fabric, with the
// user as issuer.
//
//   UserActions user_actions({.users = users, .host = host_name(), …}, log);
//   Site site({…, .action_handler = &user_actions});
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <boost/json/object.hpp>
#include <tl/expected.hpp>

#include "base/program/log.hpp"
#include "fabric/command.hpp"
#include "tools/web/actions/sessions.hpp"
#include "tools/web/actions/users.hpp"
#include "tools/web/http/site.hpp"

namespace millrace::tools::web::actions {

/// A call of a service without a controller.
struct ServiceCall {
  std::string uuid{};
  /// CP1252.
  std::string text{};
  std::uint32_t state = 1;
  /// The instance is chosen as for a call of this channel; empty = any.
  std::string machine{};
  std::uint16_t channel = 1;
  std::chrono::milliseconds patience{10000};
};

struct UserActionsOptions {
  Users users{};
  /// Host name of this server, for the issuer of commands.
  std::string host{};
  /// Browsers send the cookie only over TLS.
  bool secure_cookie = false;
  /// Calls and waits, in one of several threads; returns the end as `millrace call --json` prints
  /// it.
  std::function<boost::json::object(const ServiceCall&)> call{};
  /// Forgets these machines for a user; false if a gateway reports one of them.
  std::function<bool(const std::vector<std::string>& machines, const std::string& user,
                     const fabric::Moment&)>
      forget{};
};

class UserActions : public http::ActionHandler {
 public:
  /// Sends a command and waits for its outcome; nothing if none arrives. Runs in the operators'
  /// thread.
  using Issue = std::function<std::optional<fabric::Outcome>(const fabric::Command&)>;
  /// Stores an acknowledgement.
  using Acknowledge = std::function<void(const plant::Acknowledgement&, const fabric::Moment&)>;
  /// Draws an unpredictable text.
  using Secret = std::function<std::string()>;

  UserActions(UserActionsOptions options, Issue issue, Acknowledge acknowledge, Secret secret,
              base::program::Log log)
      : options_(std::move(options)),
        issue_(std::move(issue)),
        acknowledge_(std::move(acknowledge)),
        sessions_(std::move(secret)),
        log_(std::move(log)) {}

  http::Outcome answer(const std::vector<std::string>& path, const http::Request& request,
                       const fabric::Moment& now) override;
  [[nodiscard]] bool is_logged_in(const http::Request& request, const fabric::Moment& now) override;

 private:
  http::Response session(const http::Request& request, const fabric::Moment& now);
  http::Outcome log_in(const http::Request& request, const fabric::Moment& now);
  http::Response log_out(const http::Request& request);
  http::Response enter(const Throttle::Who& who, const fabric::Moment& now);
  http::Response refuse(const Throttle::Who& who);
  http::Outcome act(const std::string& what, const http::Request& request,
                    const fabric::Moment& now);
  http::Response acknowledge(const std::string& user, const http::Request& request,
                             const fabric::Moment& now);
  http::Response forget(const std::string& user, const http::Request& request,
                        const fabric::Moment& now);
  http::Outcome call(const http::Request& request, const fabric::Moment& now);
  /// The session of the request; the error is the response.
  tl::expected<const Session*, http::Response> session_of(const http::Request& request,
                                                          const fabric::Moment& now);
  http::Response report(const fabric::Command& command, const std::string& user,
                        const std::optional<fabric::Outcome>& outcome);
  [[nodiscard]] boost::json::object json_of(const Session& session) const;
  /// The user may answer, retry or drain.
  [[nodiscard]] bool may_act(const std::string& user) const;

  UserActionsOptions options_;
  Issue issue_;
  Acknowledge acknowledge_;
  Sessions sessions_;
  Throttle throttle_;
  base::program::Log log_;
};

/// The command for a body of /api/actions/WHAT, without id, issuer and time. The error names what
/// was expected.
tl::expected<fabric::Command, std::string> command_of(std::string_view what, std::string_view body);

/// The call of a body of /api/call. The error names what was expected.
tl::expected<ServiceCall, std::string> service_call_of(std::string_view body);

/// 256 random bits in hexadecimal digits. Throws std::runtime_error if the system has none.
std::string draw_secret();

}  // namespace millrace::tools::web::actions
