#include "tools/web/actions/sessions.hpp"

#include <algorithm>

#include "base/text/ascii.hpp"

namespace millrace::tools::web::actions {

const Session& Sessions::open(const std::string& user, fabric::SteadyTime now) {
  if (sessions_.size() >= most) {
    sessions_.erase(std::ranges::min_element(
        sessions_, {}, [](const auto& session) { return session.second.used; }));
  }
  Session session{.id = secret_(), .token = secret_(), .user = user, .opened = now, .used = now};
  return sessions_.insert_or_assign(session.id, session).first->second;
}

const Session* Sessions::find(std::string_view id, fabric::SteadyTime now) {
  const auto found = sessions_.find(id);
  if (found == sessions_.end()) {
    return nullptr;
  }
  Session& session = found->second;
  if (now - session.opened > longest || now - session.used > longest_idle) {
    sessions_.erase(found);
    return nullptr;
  }
  session.used = now;
  return &session;
}

void Sessions::close(std::string_view id) {
  if (const auto found = sessions_.find(id); found != sessions_.end()) {
    sessions_.erase(found);
  }
}

std::chrono::seconds Throttle::try_now(const Who& who, fabric::SteadyTime now) {
  const auto known = failures_.find(who);
  if (known != failures_.end() && known->second.until > now) {
    return std::chrono::ceil<std::chrono::seconds>(known->second.until - now);
  }
  if (failures_.size() >= most_names && known == failures_.end()) {
    failures_.erase(std::ranges::min_element(
        failures_, {}, [](const auto& failures) { return failures.second.until; }));
  }
  Failures& failures = failures_[who];
  const int beyond = ++failures.count - free_tries;
  if (beyond >= 0) {
    constexpr int doublings = 6;  // One more would exceed the longest pause.
    failures.until = now + std::min<std::chrono::seconds>(
                               first_pause * (1 << std::min(beyond, doublings)), longest_pause);
  }
  return std::chrono::seconds(0);
}

std::string_view cookie_in(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = header.find(';');
    const std::string_view part = base::text::trim(header.substr(0, end));
    if (part.size() > name.size() && part.starts_with(name) && part[name.size()] == '=') {
      return part.substr(name.size() + 1);
    }
    header = end == std::string_view::npos ? std::string_view{} : header.substr(end + 1);
  }
  return {};
}

}  // namespace millrace::tools::web::actions
