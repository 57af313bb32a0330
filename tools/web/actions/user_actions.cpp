#include "tools/web/actions/user_actions.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <boost/json/array.hpp>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/messages.hpp"
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
  const auto object = http::object_in(body);
  auto user = object ? http::text_in(*object, "user") : std::nullopt;
  auto password = object ? http::text_in(*object, "password") : std::nullopt;
  if (!user || !password || user->size() > longest_password ||
      password->size() > longest_password) {
    return std::nullopt;
  }
  return Login{*std::move(user), *std::move(password)};
}

tl::unexpected<std::string> wrong(std::string what) {
  return tl::unexpected(std::move(what));
}

template <typename Value>
using Result = tl::expected<Value, std::string>;

Result<std::string> text_in(const boost::json::object& body, const char* name) {
  auto text = http::text_in(body, name);
  return text ? Result<std::string>(*std::move(text))
              : wrong(fmt::format("expected a text \"{}\"", name));
}

Result<std::uint32_t> number_in(const boost::json::object& body, const char* name,
                                std::uint32_t last) {
  const auto* field = body.if_contains(name);
  boost::system::error_code error;
  const auto number = field == nullptr ? 0 : field->to_number<std::int64_t>(error);
  if (field == nullptr || error || number < 1 || number > last) {
    return wrong(fmt::format("expected a number \"{}\" from 1 to {}", name, last));
  }
  return static_cast<std::uint32_t>(number);
}

/// Channel and call of an answer or retry.
Result<fabric::Command> about_a_call(const boost::json::object& body, fabric::CommandKind kind) {
  const auto machine = text_in(body, "machine");
  const auto channel = number_in(body, "channel", std::numeric_limits<std::uint16_t>::max());
  const auto call = text_in(body, "call");
  if (!machine || !channel || !call) {
    return wrong(!machine ? machine.error() : !channel ? channel.error() : call.error());
  }
  const auto id = fabric::parse_call_id(*call);
  if (!id) {
    return wrong("\"call\" is not an id of a call; expected one as in 5f3a9c0112d4-17");
  }
  return fabric::Command{
      .kind = kind, .key = {*machine, static_cast<std::uint16_t>(*channel)}, .call = *id};
}

/// A text as a controller has it. `what` names it in the error.
Result<std::string> controller_text(const std::string& utf8, const char* what) {
  auto text = base::text::to_cp1252(utf8);
  if (!text) {
    return wrong(fmt::format("the {} is no text of a controller: {}", what, text.error()));
  }
  if (text->size() > fabric::max_text || text->find('\0') != std::string::npos) {
    return wrong(fmt::format("the {} has {} bytes; a controller's string holds 127, none of them 0",
                             what, text->size()));
  }
  return *std::move(text);
}

Result<fabric::Command> an_answer(const boost::json::object& body) {
  const auto response = text_in(body, "response");
  const auto state = number_in(body, "state", std::numeric_limits<std::uint32_t>::max());
  if (!response || !state) {
    return wrong(!response ? response.error() : state.error());
  }
  const auto text = controller_text(*response, "response");
  if (!text) {
    return wrong(text.error());
  }
  return about_a_call(body, fabric::CommandKind::answer).map([&](fabric::Command command) {
    command.text = *text;
    command.state = *state;
    return command;
  });
}

Result<fabric::Command> a_drain(const boost::json::object& body) {
  return text_in(body, "instance").and_then([](const std::string& text) -> Result<fabric::Command> {
    const auto id = fabric::InstanceId::parse(text);
    if (!id) {
      return wrong("\"instance\" is not an id of an instance");
    }
    return fabric::Command{.kind = fabric::CommandKind::drain, .instance = *id};
  });
}

/// Names of machines in a body of /api/actions/forget. The error names what was expected.
Result<std::vector<std::string>> machines_of(std::string_view body) {
  const auto object = http::object_in(body);
  const auto* const list =
      object && object->contains("machines") ? object->at("machines").if_array() : nullptr;
  const bool is_list_of_texts =
      list != nullptr && !list->empty() &&
      std::ranges::all_of(*list, [](const auto& each) { return each.is_string(); });
  if (!is_list_of_texts) {
    return wrong("expected \"machines\", a list of names");
  }
  std::vector<std::string> machines;
  for (const boost::json::value& each : *list) {
    machines.emplace_back(each.as_string());
  }
  return machines;
}

/// The refusal for a user whose permissions do not suffice.
http::Response forbidden(const std::string& user, std::string_view what = "do this") {
  return http::error_response(403, fmt::format("{} is not allowed to {}; the file of "
                                               "--allow-actions lists the permissions",
                                               user, what));
}

/// Parses the body of /api/actions/acknowledge. The error names what was expected.
Result<plant::Acknowledgement> acknowledgement_of(std::string_view body) {
  const auto object = http::object_in(body);
  if (!object) {
    return wrong("expected a JSON object");
  }
  plant::Acknowledgement out;
  const std::array<std::pair<const char*, std::string*>, 4> fields{{{"cause", &out.cause},
                                                                    {"name", &out.name.text},
                                                                    {"since", &out.since},
                                                                    {"note", &out.note}}};
  for (const auto& [name, field] : fields) {
    const auto text = text_in(*object, name);
    if (!text) {
      return wrong(text.error());
    }
    constexpr std::size_t longest = 500;
    if (text->size() > longest) {
      return wrong(fmt::format("\"{}\" has more than {} bytes", name, longest));
    }
    *field = *text;
  }
  if (out.cause.empty()) {
    return wrong("expected a \"cause\" that is not empty");
  }
  return out;
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
  if (!request.content_type.starts_with("application/json")) {
    // A form of a foreign page can send everything but this.
    return http::error_response(400, "expected Content-Type: application/json");
  }
  if (what == "login" && path.size() == 1) {
    return log_in(request, now);
  }
  if (what == "logout" && path.size() == 1) {
    return log_out(request);
  }
  if (what == "call" && path.size() == 1) {
    return call(request, now);
  }
  if (what == "actions" && path.size() == 2) {
    return act(path[1], request, now);
  }
  return http::error_response(404,
                              "there is no such action; docs/reference/http-api.md names them");
}

bool UserActions::is_logged_in(const http::Request& request, const fabric::Moment& now) {
  return sessions_.find(cookie_in(request.cookie, cookie_name), now.steady) != nullptr;
}

boost::json::object UserActions::json_of(const Session& session) const {
  boost::json::array may;
  if (const auto user = options_.users.find(session.user); user != options_.users.end()) {
    for (const fabric::CommandKind kind : user->second.may) {
      may.emplace_back(name_of(kind));
    }
    if (user->second.may_call) {
      may.emplace_back("call");
    }
    may.emplace_back("acknowledge");
    if (may_act(session.user)) {
      may.emplace_back("forget");
    }
  }
  return {
      {"actions", true}, {"user", session.user}, {"token", session.token}, {"may", std::move(may)}};
}

bool UserActions::may_act(const std::string& user) const {
  const auto found = options_.users.find(user);
  return found != options_.users.end() && !found->second.may.empty();
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

tl::expected<const Session*, http::Response> UserActions::session_of(const http::Request& request,
                                                                     const fabric::Moment& now) {
  const Session* session = sessions_.find(cookie_in(request.cookie, cookie_name), now.steady);
  if (session == nullptr) {
    return tl::unexpected(http::error_response(401, "your session has expired; log in again"));
  }
  // Compares in a time that does not depend on the place of a difference.
  if (request.token.size() != session->token.size() ||
      ::CRYPTO_memcmp(request.token.data(), session->token.data(), request.token.size()) != 0) {
    return tl::unexpected(http::error_response(403, "the page is outdated; reload it"));
  }
  return session;
}

http::Outcome UserActions::call(const http::Request& request, const fabric::Moment& now) {
  const auto session = session_of(request, now);
  if (!session) {
    return session.error();
  }
  const std::string& name = (*session)->user;
  const auto user = options_.users.find(name);
  if (user == options_.users.end() || !user->second.may_call || !options_.call) {
    return forbidden(name, "call services");
  }
  const auto wanted = service_call_of(request.body);
  if (!wanted) {
    return http::error_response(400, wanted.error());
  }
  return http::Later{http::WorkerKind::calls,
                     [this, call = *wanted, name]() -> std::function<http::Response()> {
                       return [this, call, name, ended = options_.call(call)] {
                         const bool answered = ended.at("answered").as_bool();
                         log_->info("{}: call of {}: {}", name, base::text::safe(call.uuid),
                                    answered ? "answered" : "no response");
                         constexpr unsigned no_response = 504;
                         return http::json_response(ended, answered ? 200 : no_response);
                       };
                     }};
}

http::Outcome UserActions::act(const std::string& what, const http::Request& request,
                               const fabric::Moment& now) {
  const auto found = session_of(request, now);
  if (!found) {
    return found.error();
  }
  const Session* const session = *found;
  if (what == "acknowledge") {
    return acknowledge(session->user, request, now);
  }
  if (what == "forget") {
    return forget(session->user, request, now);
  }
  auto command = command_of(what, request.body);
  if (!command) {
    return http::error_response(400, command.error());
  }
  const auto user = options_.users.find(session->user);
  if (user == options_.users.end() || !user->second.may.contains(command->kind)) {
    return forbidden(session->user);
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
  auto acknowledgement = acknowledgement_of(request.body);
  if (!acknowledgement) {
    return http::error_response(400, acknowledgement.error());
  }
  acknowledgement->by = user;
  acknowledge_(*acknowledgement, now);
  log_->info("{}: acknowledged {}", user, base::text::safe(acknowledgement->name));
  return http::json_response(boost::json::object{{"done", true}, {"detail", ""}});
}

/// It changes nothing in the plant, but other users no longer see these machines.
http::Response UserActions::forget(const std::string& user, const http::Request& request,
                                   const fabric::Moment& now) {
  if (!may_act(user) || !options_.forget) {
    return forbidden(user);
  }
  const auto machines = machines_of(request.body);
  if (!machines) {
    return http::error_response(400, machines.error());
  }
  const bool done = options_.forget(*machines, user, now);
  log_->info("{}: forget {}: {}", user,
             base::text::safe(fmt::format("{}", fmt::join(*machines, ", "))),
             done ? "done" : "refused");
  return http::json_response(boost::json::object{
      {"done", done},
      {"detail", done ? "" : "a gateway reports one of them, or the server does not know it"}});
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
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

tl::expected<fabric::Command, std::string> command_of(std::string_view what,
                                                      std::string_view body) {
  const auto object = http::object_in(body);
  if (!object) {
    return wrong("expected a JSON object");
  }
  if (what == "answer") {
    return an_answer(*object);
  }
  if (what == "retry") {
    return about_a_call(*object, fabric::CommandKind::retry);
  }
  if (what == "drain") {
    return a_drain(*object);
  }
  return wrong("there is no such action; expected answer, retry, drain, acknowledge or forget");
}

tl::expected<ServiceCall, std::string> service_call_of(std::string_view body) {
  constexpr std::uint32_t longest_ms = 30'000;
  const auto object = http::object_in(body);
  if (!object) {
    return wrong("expected a JSON object");
  }
  ServiceCall call;
  const auto number = [&](const char* name, std::uint32_t otherwise, std::uint32_t last) {
    return object->contains(name) ? number_in(*object, name, last)
                                  : Result<std::uint32_t>(otherwise);
  };
  const auto uuid = text_in(*object, "uuid");
  const auto text = text_in(*object, "text").and_then([](const std::string& utf8) {
    return controller_text(utf8, "text");
  });
  const auto machine =
      object->contains("machine") ? text_in(*object, "machine") : Result<std::string>(call.machine);
  const auto state = number("state", call.state, std::numeric_limits<std::uint32_t>::max());
  const auto channel = number("channel", call.channel, std::numeric_limits<std::uint16_t>::max());
  const auto patience =
      number("timeout_ms", static_cast<std::uint32_t>(call.patience.count()), longest_ms);
  for (const auto* const field : {&uuid, &text, &machine}) {
    if (!*field) {
      return wrong(field->error());
    }
  }
  for (const auto* const field : {&state, &channel, &patience}) {
    if (!*field) {
      return wrong(field->error());
    }
  }
  call.uuid = base::text::to_cp1252(*uuid).value_or(*uuid);
  call.text = *text;
  call.state = *state;
  call.machine = *machine;
  call.channel = static_cast<std::uint16_t>(*channel);
  call.patience = std::chrono::milliseconds(*patience);
  return call;
}

}  // namespace millrace::tools::web::actions
