#include "tools/web/http/site.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include <arpa/inet.h>
#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "fabric/messages.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::http {

namespace {

constexpr std::size_t calls_unless_asked = 200;
constexpr std::size_t most_calls = 2'000;
/// Alarms of a recording in one response.
constexpr std::size_t most_alarms = 500;
constexpr std::size_t runs_unless_asked = 100;
constexpr std::size_t most_runs = 2'000;
/// Lines over time in one response.
constexpr std::size_t most_lines = 32;

Response not_found(std::string_view what) {
  return error_response(
      404,
      fmt::format("there is no {}; docs/reference/http-api.md lists all paths below /api", what));
}

template <typename Value>
Response response_of(Recordings::Result<Value> result) {
  return result ? json_response(*result)
                : error_response(result.error().status, result.error().what);
}

template <typename Work>
Later later(WorkerKind worker, Work work) {
  return {worker, [work = std::move(work)] { return [response = work()] { return response; }; }};
}

/// A number of the query, or `otherwise`; nothing if the text is not a number.
std::optional<std::size_t> number_in(const Target& target, const std::string& name,
                                     std::size_t otherwise) {
  const std::string text = target.value(name);
  return text.empty() ? otherwise : base::text::parse_number<std::size_t>(text);
}

/// 0 if the query has no channel. The error names what was expected.
tl::expected<std::uint16_t, std::string> channel_of(const Target& target) {
  const std::string channel = target.value("channel");
  const auto number = base::text::parse_number<std::uint16_t>(channel.empty() ? "0" : channel);
  if (!number) {
    return tl::unexpected(fmt::format("channel={} is not a number from 1 to 65535", channel));
  }
  return *number;
}

/// The error names what was expected.
tl::expected<plant::CallFilter, std::string> filter_of(const Target& target) {
  const auto number = channel_of(target);
  if (!number) {
    return tl::unexpected(number.error());
  }
  constexpr std::array<std::string_view, 5> results{"", "answered", "other_state", "failed",
                                                    "withdrawn"};
  const std::string result = target.value("result");
  if (std::ranges::find(results, result) == results.end()) {
    return tl::unexpected(
        fmt::format("result={} is none of answered, other_state, failed, withdrawn", result));
  }
  return plant::CallFilter{.machine = target.value("machine"),
                           .channel = *number,
                           .uuid = fabric::canonical_uuid(target.value("uuid")),
                           .instance = target.value("instance"),
                           .failed = target.value("failed") == "1",
                           .other_state = target.value("other_state") == "1",
                           .result = result,
                           .text = base::text::small_letters(target.value("text"))};
}

}  // namespace

std::string_view name_of_host(std::string_view host) {
  const std::size_t end = host.starts_with('[') ? host.find(']') : host.find(':');
  const std::string_view name = host.starts_with('[') && end != std::string_view::npos
                                    ? host.substr(0, end + 1)
                                    : host.substr(0, end);
  const std::string_view port = host.substr(name.size());
  const bool is_port = port.empty() || (port.starts_with(':') && port.size() > 1 &&
                                        base::text::parse_number<std::uint16_t>(port.substr(1)));
  return is_port ? name : std::string_view();
}

bool is_address(std::string_view name) {
  const bool in_brackets = name.starts_with('[') && name.ends_with(']');
  const std::string text(in_brackets ? name.substr(1, name.size() - 2) : name);
  in6_addr address{};
  return ::inet_pton(in_brackets ? AF_INET6 : AF_INET, text.c_str(), &address) == 1;
}

std::optional<Response> Site::refusal_of(const Request& request) const {
  const std::string name = base::text::small_letters(std::string(name_of_host(request.host)));
  if (request.host.empty()) {
    return error_response(400, "this request has no Host; send the name or address of this server");
  }
  if (!is_address(name) && name != "localhost" && !parts_.names.contains(name)) {
    return error_response(
        403, fmt::format("this server is not called '{}'; start it with --name {} if it is", name,
                         name));
  }
  if (request.method == "POST") {
    const bool other_page =
        (!request.origin.empty() && request.origin != "http://" + request.host &&
         request.origin != "https://" + request.host) ||
        (!request.fetch_site.empty() && request.fetch_site != "same-origin" &&
         request.fetch_site != "none");
    if (other_page) {
      return error_response(403, "this comes from a page of another server; use the page itself");
    }
    return std::nullopt;
  }
  if (request.method != "GET" && request.method != "HEAD") {
    Response response = error_response(405, "only GET, HEAD and POST are understood");
    response.headers.emplace_back("Allow", "GET, HEAD, POST");
    return response;
  }
  return std::nullopt;
}

Outcome Site::answer(const Request& request, const fabric::Moment& now) const {
  if (auto refusal = refusal_of(request)) {
    return std::move(*refusal);
  }
  const auto target = parse_target(request.target);
  if (!target) {
    return error_response(400, "the address of this request is malformed");
  }
  const std::vector<std::string>& path = target->path;
  if (!path.empty() && path.front() == "api") {
    return api(*target, request, now);
  }
  if (request.method == "POST") {
    return error_response(405, "only GET and HEAD are understood here");
  }
  if (path.size() == 1 && path.front() == "healthz") {
    return json_response(boost::json::object{{"status", "ok"}});
  }
  if (path.size() == 1 && path.front() == "metrics" && parts_.metrics) {
    return Response{.content_type = "text/plain; version=0.0.4; charset=utf-8",
                    .body = std::make_shared<const std::string>(parts_.metrics()),
                    .headers = {{"Cache-Control", "no-store"}}};
  }
  std::string name;
  for (const std::string& part : path) {
    name += (name.empty() ? "" : "/") + part;
  }
  if (auto page = parts_.pages.answer(name, request)) {
    return std::move(*page);
  }
  return error_response(404, "there is no such file; the page is at /");
}

Outcome Site::api(const Target& target, const Request& request, const fabric::Moment& now) const {
  const std::vector<std::string> path(target.path.begin() + 1, target.path.end());
  const std::string what = path.empty() ? std::string() : path.front();
  if (what == "session" || what == "login" || what == "logout" || what == "actions" ||
      what == "call") {
    if (parts_.action_handler != nullptr) {
      return parts_.action_handler->answer(path, request, now);
    }
    if (what == "session" && path.size() == 1 && request.method != "POST") {
      return json_response(boost::json::object{{"actions", false}});
    }
    return error_response(403, "actions are disabled; start 'millrace web' with --allow-actions");
  }
  if (request.method == "POST") {
    return error_response(405, "only GET and HEAD are understood here");
  }
  if (what == "recordings") {
    if (parts_.login_for_recordings && !parts_.action_handler->is_logged_in(request, now)) {
      return error_response(401, "log in to see recordings");
    }
    return recordings(target);
  }
  if (what == "calls") {
    return calls(target);
  }
  if (what == "data") {
    return data(target, now);
  }
  if (what == "programs") {
    return programs(target);
  }
  if (path.size() != 1) {
    return not_found("such thing");
  }
  if (what == "live") {
    return StreamLive{};
  }
  if (what == "about") {
    return json_response(parts_.plant.about(now));
  }
  if (what == "snapshot") {
    return json_response(parts_.plant.snapshot(now));
  }
  if (what == "machines") {
    return json_response(parts_.plant.machines());
  }
  if (what == "channels") {
    return json_response(parts_.plant.channels(now));
  }
  if (what == "services") {
    return json_response(parts_.plant.services(now));
  }
  if (what == "events") {
    return json_response(parts_.plant.events());
  }
  if (what == "alarms") {
    return json_response(parts_.plant.alarms());
  }
  if (what == "concerns") {
    return json_response(print::json_of(parts_.plant.concerns(now)));
  }
  if (what == "history") {
    return json_response(parts_.plant.history());
  }
  if (what == "doctor" && parts_.doctor) {
    return later(WorkerKind::doctor, [look = parts_.doctor()] { return json_response(look()); });
  }
  return not_found("such thing");
}

Outcome Site::calls(const Target& target) const {
  if (target.path.size() == 2) {
    const auto filter = filter_of(target);
    const auto limit = number_in(target, "limit", calls_unless_asked);
    if (!filter || !limit) {
      return error_response(400, filter ? "limit is not a number" : filter.error());
    }
    return json_response(parts_.plant.calls(*filter, std::min(*limit, most_calls)));
  }
  const auto call = target.path.size() == 3 ? fabric::parse_call_id(target.path[2]) : std::nullopt;
  if (!call) {
    return not_found("such call");
  }
  const recording::Timeline timeline = parts_.plant.call_store().timeline(*call);
  if (timeline.steps.empty()) {
    return error_response(404, fmt::format("call {} is no longer stored; a recording may "
                                           "have it",
                                           call->to_string()));
  }
  return json_response(print::json_of(timeline));
}

Outcome Site::data(const Target& target, const fabric::Moment& now) const {
  const plant::DataStore& store = parts_.plant.data();
  if (target.path.size() == 2) {
    const auto channel = channel_of(target);
    const auto elements = number_in(target, "elements", std::numeric_limits<std::size_t>::max());
    if (!channel || !elements) {
      return error_response(400, channel ? "elements is not a number" : channel.error());
    }
    return json_response(store.samples({.machine = target.value("machine"),
                                        .channel = *channel,
                                        .group = target.value("group"),
                                        .most_elements = *elements}));
  }
  if (target.path.size() == 3 && target.path[2] == "machines") {
    std::set<std::string> machines;
    store.add_machines(machines);
    parts_.plant.programs().add_machines(machines);
    boost::json::array names;
    for (const std::string& machine : machines) {
      names.emplace_back(print::utf8(machine));
    }
    return json_response(names);
  }
  if (target.path.size() != 3 || target.path[2] != "history") {
    return not_found("such path of machine data");
  }
  const std::vector<std::string> variables = target.values("variable");
  const std::vector<std::string> since = target.values("since");
  if (variables.size() > most_lines || since.size() > variables.size()) {
    return error_response(
        400, fmt::format("expected at most {} times variable=CHANNEL/GROUP/NAME, and since= for "
                         "none or for each of them",
                         most_lines));
  }
  std::vector<plant::LineRequest> wanted;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    // Milliseconds since 1970; later times overflow nanoseconds.
    constexpr std::int64_t latest = 9'000'000'000'000;
    const auto from = i < since.size() && !since[i].empty()
                          ? base::text::parse_number<std::int64_t>(since[i])
                          : std::optional<std::int64_t>(0);
    if (!from || *from < 0 || *from > latest) {
      return error_response(400, fmt::format("since={} is not a time in milliseconds", since[i]));
    }
    wanted.push_back({variables[i], fabric::Time(std::chrono::milliseconds(*from))});
  }
  return json_response(store.history(target.value("machine"), wanted, now.wall));
}

Outcome Site::programs(const Target& target) const {
  const plant::ProgramStore& store = parts_.plant.programs();
  const auto channel = channel_of(target);
  const auto limit = number_in(target, "limit", runs_unless_asked);
  if (!channel || !limit) {
    return error_response(400, channel ? "limit is not a number" : channel.error());
  }
  const plant::ProgramFilter filter{.machine = target.value("machine"), .channel = *channel};
  if (target.path.size() == 2) {
    return json_response(store.last(filter));
  }
  if (target.path.size() == 3 && target.path[2] == "runs") {
    return json_response(store.runs(filter, std::min(*limit, most_runs)));
  }
  return not_found("such path of programs");
}

Outcome Site::recordings(const Target& target) const {
  const auto files = parts_.recordings;
  if (!files) {
    return error_response(404, "recordings are disabled; start 'millrace web' with --recordings");
  }
  const std::vector<std::string>& path = target.path;
  if (path.size() == 2) {
    return later(WorkerKind::recordings, [files] { return response_of(files->list()); });
  }
  const std::string name = path[2];
  if (path.size() == 3) {
    return later(WorkerKind::recordings, [files, name] { return response_of(files->info(name)); });
  }
  if (path.size() == 4 && path[3] == "file") {
    auto file = files->download(name);
    return file ? Outcome(std::move(*file))
                : Outcome(error_response(file.error().status, file.error().what));
  }
  if (path.size() == 4 && path[3] == "alarms") {
    return later(WorkerKind::recordings,
                 [files, name] { return response_of(files->alarms(name, most_alarms)); });
  }
  if (path[3] != "calls" || path.size() > 5) {
    return not_found("such path of a recording");
  }
  if (path.size() == 5) {
    const auto call = fabric::parse_call_id(path[4]);
    if (!call) {
      return not_found("such call");
    }
    return later(WorkerKind::recordings,
                 [files, name, id = *call] { return response_of(files->timeline(name, id)); });
  }
  const auto filter = filter_of(target);
  const auto limit = number_in(target, "limit", calls_unless_asked);
  const auto skip = number_in(target, "skip", 0);
  if (!filter || !limit || !skip) {
    return error_response(400, filter ? "limit or skip is not a number" : filter.error());
  }
  return later(WorkerKind::recordings, [files, name, wanted = *filter, skipped = *skip,
                                        most = std::min(*limit, most_calls)] {
    return response_of(files->calls(name, wanted, skipped, most));
  });
}

}  // namespace millrace::tools::web::http
