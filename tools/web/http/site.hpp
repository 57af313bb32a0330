// What is answered to which request. Decides, and does nothing itself: what takes time comes back
// as work for a thread beside the loop.
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
#include "tools/web/http/target.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::http {

/// What acts for a user; where nobody may act there is none.
class ActionHandler {
 public:
  virtual ~ActionHandler() = default;
  /// /api/session, /api/login, /api/logout and /api/actions/…; `path` is what follows /api/.
  virtual Outcome answer(const std::vector<std::string>& path, const Request& request,
                         const fabric::Moment& now) = 0;
};

struct SiteParts {
  const plant::PlantModel& plant;
  const Pages& pages;
  /// Nothing: no folder was given.
  std::shared_ptr<const Recordings> recordings{};
  /// The text of /metrics.
  std::function<std::string()> metrics{};
  /// Called on the loop; what it returns blocks, and gives what `doctor --json` prints, of the last
  /// seconds.
  std::function<std::function<boost::json::object()>()> doctor{};
  ActionHandler* action_handler = nullptr;
  /// Names of this server that a browser may use, besides addresses and "localhost": a page of
  /// somebody else, whose name was made to mean this host, does not get in.
  std::set<std::string> names{};
};

class Site {
 public:
  /// `parts` outlive it.
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

/// "hall-pc" of "hall-pc:8443", "[::1]" of "[::1]:8080"; empty where what follows is no port.
std::string_view name_of_host(std::string_view host);
/// An IPv4 address, or an IPv6 one in brackets.
bool is_address(std::string_view name);

}  // namespace millrace::tools::web::http
