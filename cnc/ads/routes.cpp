#include "cnc/ads/routes.hpp"

#include <algorithm>

namespace millrace::cnc::ads {

void Routes::add(const Route& route) {
  constexpr std::size_t most = 1000;
  const auto known = std::ranges::find(routes_, route.net_id, &Route::net_id);
  if (known != routes_.end()) {
    *known = route;
  } else if (routes_.size() < most) {
    routes_.push_back(route);
  }
  added_(route);
}

bool Routes::knows(const Route& route) const {
  return std::ranges::count(routes_, route) > 0;
}

ConnectError admit(const ConnectInfo& request, const TlsClient& client,
                   const ServerSecurity& security, Routes& routes) {
  if (request.version != 1) {
    return ConnectError::version;
  }
  if (client.fingerprint.empty()) {
    return ConnectError::none;  // the pre-shared key identifies the client
  }
  if (security.shared_ca) {
    const bool right = security.shared_ca->ignore_common_name ||
                       client.common_name == client.address ||
                       std::ranges::count(security.shared_ca->clients, client.common_name) > 0;
    return right ? ConnectError::none : ConnectError::common_name;
  }
  if ((request.flags & connect_flags::self_signed) == 0 || !security.self_signed) {
    return ConnectError::unknown_certificate;
  }
  const Route route{request.net_id, client.fingerprint};
  if ((request.flags & connect_flags::add_route) == 0) {
    return routes.knows(route) ? ConnectError::none : ConnectError::unknown_certificate;
  }
  const auto& owner = *security.self_signed;
  if (owner.user.empty() || request.user != owner.user || request.password != owner.password) {
    return ConnectError::unknown_user;
  }
  routes.add(route);
  return ConnectError::none;
}

}  // namespace millrace::cnc::ads
