#include "tools/web/actions/sessions.hpp"

#include <algorithm>

#include "base/loop/hosts.hpp"
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

namespace {

/// All users at the address of `who`.
Throttle::Who all_of_address_of(const Throttle::Who& who) {
  return {.user = {}, .peer = base::loop::host_of(who.peer)};
}

}  // namespace

std::chrono::seconds Throttle::try_now(const Who& who, fabric::SteadyTime now) {
  const Who all_of_address = all_of_address_of(who);
  const auto pause = std::max(pause_of(who, now), pause_of(all_of_address, now));
  if (pause.count() > 0) {
    return pause;
  }
  if (failures_.size() + 2 > most_names) {
    forget_old(now);
  }
  if (failures_.size() + 2 > most_names &&
      (!failures_.contains(who) || !failures_.contains(all_of_address))) {
    return longest_pause;
  }
  count(who, free_tries, now);
  count(all_of_address, free_tries_of_address, now);
  return std::chrono::seconds(0);
}

void Throttle::succeeded(const Who& who) {
  failures_.erase(who);
  const auto of_address = failures_.find(all_of_address_of(who));
  if (of_address != failures_.end() && --of_address->second.count <= 0) {
    failures_.erase(of_address);
  }
}

std::chrono::seconds Throttle::pause_of(const Who& who, fabric::SteadyTime now) const {
  const auto known = failures_.find(who);
  return known == failures_.end() || known->second.until <= now
             ? std::chrono::seconds(0)
             : std::chrono::ceil<std::chrono::seconds>(known->second.until - now);
}

void Throttle::forget_old(fabric::SteadyTime now) {
  std::erase_if(failures_,
                [&](const auto& known) { return now - known.second.last >= remembered; });
}

void Throttle::count(const Who& who, int free, fabric::SteadyTime now) {
  Failures& failures = failures_[who];
  if (now - failures.last >= remembered) {
    failures.count = 0;
  }
  failures.last = now;
  const int beyond = ++failures.count - free;
  if (beyond >= 0) {
    constexpr int doublings = 6;  // One more would exceed the longest pause.
    failures.until = now + std::min<std::chrono::seconds>(
                               first_pause * (1 << std::min(beyond, doublings)), longest_pause);
  }
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
