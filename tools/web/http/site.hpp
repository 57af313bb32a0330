// Routes requests to responses. It decides only: slow work is returned as a job for a thread beside
// the loop.
//
//   Site site({.plant = plant, .pages = pages, …});
//   std::visit(…, site.answer(request, now));
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <boost/json/object.hpp>

#include "fabric/moment.hpp"
#include "tools/web/http/message.hpp"
#include "tools/web/http/pages.hpp"
#include "tools/web/http/recordings.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::http {

/// Performs users' actions; absent if there are no users.
class ActionHandler {
 public:
  virtual ~ActionHandler() = default;
  /// /api/session, /api/login, /api/logout and /api/actions/…; `path` is what follows /api/.
  virtual Outcome answer(const std::vector<std::string>& path, const Request& request,
                         const fabric::Moment& now) = 0;
  /// Does the request belong to the session of a user?
  [[nodiscard]] virtual bool is_logged_in(const Request& request, const fabric::Moment& now) = 0;
};

struct SiteParts {
  const plant::PlantModel& plant;
  const Pages& pages;
  /// Null without a folder.
  std::shared_ptr<const Recordings> recordings{};
  /// Needs an action handler.
  bool login_for_recordings = false;
  /// The text of /metrics.
  std::function<std::string()> metrics{};
  /// Called on the loop. Its result blocks, and returns the output of `doctor --json` for the last
  /// seconds.
  std::function<std::function<boost::json::object()>()> doctor{};
  ActionHandler* action_handler = nullptr;
  /// Names of this server that browsers may use, in addition to addresses and "localhost". This
  /// stops foreign pages whose name was made to resolve to this host (DNS rebinding).
  std::set<std::string> names{};
};

class Site {
 public:
  /// `parts` outlive the site.
  explicit Site(SiteParts parts) : parts_(std::move(parts)) {}

  [[nodiscard]] Outcome answer(const Request& request, const fabric::Moment& now) const;

 private:
  [[nodiscard]] std::optional<Response> refusal_of(const Request& request) const;
  [[nodiscard]] Outcome api(const Target& target, const Request& request,
                            const fabric::Moment& now) const;
  [[nodiscard]] Outcome calls(const Target& target) const;
  [[nodiscard]] Outcome data(const Target& target, const fabric::Moment& now) const;
  [[nodiscard]] Outcome programs(const Target& target) const;
  [[nodiscard]] Outcome recordings(const Target& target) const;

  SiteParts parts_;
};

/// "hall-pc" of "hall-pc:8443", "[::1]" of "[::1]:8080"; empty if the port is invalid.
std::string_view name_of_host(std::string_view host);
/// An IPv4 address, or an IPv6 one in brackets.
bool is_address(std::string_view name);

}  // namespace millrace::tools::web::http
