#include "tools/web/actions/user_actions.hpp"

#include <array>
#include <stdexcept>

#include <boost/json/array.hpp>
#include <boost/json/parse.hpp>
#include <fmt/format.h>
#include <sys/random.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::actions {

namespace {

constexpr const char* cookie_name = "millrace_session";
/// Longer texts are refused: hashing them would take time.
constexpr std::size_t longest_password = 512;

struct Login {
  std::string user;
  std::string password;
};

std::optional<Login> login_of(const std::string& body) {
  boost::system::error_code error;
  const boost::json::value value = boost::json::parse(body, error);
  const auto* object = error ? nullptr : value.if_object();
  const auto text = [&](const char* name) -> const boost::json::string* {
    const auto* field = object == nullptr ? nullptr : object->if_contains(name);
    return field == nullptr ? nullptr : field->if_string();
  };
  const auto* user = text("user");
  const auto* password = text("password");
  if (user == nullptr || password == nullptr || user->size() > longest_password ||
      password->size() > longest_password) {
    return std::nullopt;
  }
  return Login{{user->data(), user->size()}, {password->data(), password->size()}};
}

bool is_json(const http::Request& request) {
  return request.content_type.starts_with("application/json");
}

http::Response not_logged_in() {
  return http::error_response(401, "your session has expired; log in again");
}

}  // namespace

http::Outcome UserActions::answer(const std::vector<std::string>& path,
                                  const http::Request& request, const fabric::Moment& now) {
  const std::string& what = path.front();
  if (what == "session" && path.size() == 1 && request.method != "POST") {
    return session(request, now);
  }
  if (request.method != "POST") {
    http::Response response = http::error_response(405, "only POST is understood here");
    response.headers.emplace_back("Allow", "POST");
    return response;
  }
  if (!is_json(request)) {
    // A form of a foreign page can send everything but this.
    return http::error_response(400, "expected Content-Type: application/json");
  }
  if (what == "login" && path.size() == 1) {
    return log_in(request, now);
  }
  if (what == "logout" && path.size() == 1) {
    return log_out(request);
  }
  if (what == "actions" && path.size() == 2) {
    return act(path[1], request, now);
  }
  return http::error_response(404,
                              "there is no such action; docs/reference/http-api.md names them");
}

boost::json::object UserActions::json_of(const Session& session) const {
  boost::json::array may;
  if (const auto user = options_.users.find(session.user); user != options_.users.end()) {
    for (const fabric::CommandKind kind : user->second.may) {
      may.emplace_back(name_of(kind));
    }
    may.emplace_back("acknowledge");
  }
  return {
      {"actions", true}, {"user", session.user}, {"token", session.token}, {"may", std::move(may)}};
}

http::Response UserActions::session(const http::Request& request, const fabric::Moment& now) {
  const Session* known = sessions_.find(cookie_in(request.cookie, cookie_name), now.steady);
  return http::json_response(known == nullptr ? boost::json::object{{"actions", true}}
                                              : json_of(*known));
}

http::Outcome UserActions::log_in(const http::Request& request, const fabric::Moment& now) {
  const auto login = login_of(request.body);
  if (!login) {
    return http::error_response(400, R"(expected {"user": "…", "password": "…"})");
  }
  const Throttle::Who who{login->user, request.peer};
  if (const auto wait = throttle_.try_now(who, now.steady); wait.count() > 0) {
    http::Response response = http::error_response(
        429, fmt::format("too many wrong passwords; try again in {} s", wait.count()));
    response.headers.emplace_back("Retry-After", std::to_string(wait.count()));
    return response;
  }
  const auto user = options_.users.find(login->user);
  const std::string hash =
      user == options_.users.end() ? std::string() : user->second.password_hash;
  return http::Later{
      http::WorkerKind::operators,
      [this, who, password = login->password, hash, now]() -> std::function<http::Response()> {
        const bool right = matches(password, hash.empty() ? hash_of_unknown_user() : hash);
        if (right && !hash.empty()) {
          return [this, who, now] { return enter(who, now); };
        }
        return [this, who] { return refuse(who); };
      }};
}

http::Response UserActions::enter(const Throttle::Who& who, const fabric::Moment& now) {
  throttle_.succeeded(who);
  const Session& session = sessions_.open(who.user, now.steady);
  log_->info("{} has logged in", who.user);
  http::Response response = http::json_response(json_of(session));
  response.headers.emplace_back(
      "Set-Cookie",
      fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/; Max-Age={}{}", cookie_name, session.id,
                  std::chrono::seconds(Sessions::longest).count(),
                  options_.secure_cookie ? "; Secure" : ""));
  return response;
}

http::Response UserActions::refuse(const Throttle::Who& who) {
  log_->warn("{}: a wrong user or password, as \"{}\"", who.peer, base::text::safe(who.user));
  return http::error_response(401, "user or password is wrong");
}

http::Response UserActions::log_out(const http::Request& request) {
  sessions_.close(cookie_in(request.cookie, cookie_name));
  http::Response response = http::json_response(boost::json::object{{"actions", true}});
  response.headers.emplace_back(
      "Set-Cookie", fmt::format("{}=; HttpOnly; SameSite=Strict; Path=/; Max-Age=0{}", cookie_name,
                                options_.secure_cookie ? "; Secure" : ""));
  return response;
}

http::Outcome UserActions::act(const std::string& what, const http::Request& request,
                               const fabric::Moment& now) {
  const Session* session = sessions_.find(cookie_in(request.cookie, cookie_name), now.steady);
  if (session == nullptr) {
    return not_logged_in();
  }
  if (!same_secret(request.token, session->token)) {
    return http::error_response(403, "the page is outdated; reload it");
  }
  if (what == "acknowledge") {
    return acknowledge(session->user, request, now);
  }
  auto command = command_of(what, request.body);
  if (!command) {
    return http::error_response(400, command.error());
  }
  const auto user = options_.users.find(session->user);
  if (user == options_.users.end() || !user->second.may.contains(command->kind)) {
    return http::error_response(403, fmt::format("{} is not allowed to do this; the file of "
                                                 "--allow-actions lists the permissions",
                                                 session->user));
  }
  command->id = fabric::InstanceId::random();
  // The issuer has at most 127 bytes.
  command->issuer = fmt::format("{:.31}@{:.63}/web", user->first, options_.host);
  command->at = now.wall;
  return http::Later{http::WorkerKind::operators, [this, command = *command, name = user->first] {
                       const auto outcome = issue_(command);
                       return [this, command, name, outcome] {
                         return report(command, name, outcome);
                       };
                     }};
}

/// It changes nothing in the plant, so each logged-in user may do it.
http::Response UserActions::acknowledge(const std::string& user, const http::Request& request,
                                        const fabric::Moment& now) {
  const auto said = acknowledgement_of(request.body);
  if (!said) {
    return http::error_response(400, said.error());
  }
  acknowledge_(*said, user, now);
  log_->info("{}: acknowledged {}", user, base::text::safe(said->name));
  return http::json_response(boost::json::object{{"done", true}, {"detail", ""}});
}

http::Response UserActions::report(const fabric::Command& command, const std::string& user,
                                   const std::optional<fabric::Outcome>& outcome) {
  const bool is_drain = command.kind == fabric::CommandKind::drain;
  const std::string whom = is_drain ? command.instance.to_string()
                                    : fmt::format("call {} of {}", command.call.to_string(),
                                                  base::text::safe(command.key.to_string()));
  if (!outcome) {
    log_->warn("{}: {} of {}: no response", user, name_of(command.kind), whom);
    return http::error_response(
        504, is_drain ? "the instance does not respond; it may have ended"
                      : "the gateway of this channel does not respond; it may have ended");
  }
  log_->info("{}: {} of {}: {}, {}", user, name_of(command.kind), whom,
             outcome->done ? "done" : "refused", base::text::safe(outcome->detail));
  return http::json_response(
      boost::json::object{{"done", outcome->done}, {"detail", print::utf8(outcome->detail)}});
}

std::string draw_secret() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("this system has no random numbers");
  }
  std::string text;
  for (const unsigned char byte : bytes) {
    text += fmt::format("{:02x}", byte);
  }
  return text;
}

}  // namespace millrace::tools::web::actions
