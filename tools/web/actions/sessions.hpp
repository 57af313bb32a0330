// Who is logged in. Pure but for its random numbers, which it is given.
//
//   const Session& session = sessions.open("anna", now);
//   sessions.find(cookie, now)            // nullptr: log in again
#pragma once

#include <chrono>
#include <compare>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "fabric/moment.hpp"

namespace millrace::tools::web::actions {

struct Session {
  /// The cookie: whoever has it is the user.
  std::string id{};
  /// What the page sends with each action: a page of somebody else, to whose requests the browser
  /// may add the cookie, does not know it.
  std::string token{};
  std::string user{};
  fabric::SteadyTime opened{};
  fabric::SteadyTime used{};
};

class Sessions {
 public:
  static constexpr std::chrono::hours longest{8};
  static constexpr std::chrono::minutes longest_idle{30};
  static constexpr std::size_t most = 100;

  /// `secret` draws a text that nobody can guess.
  explicit Sessions(std::function<std::string()> secret) : secret_(std::move(secret)) {}

  /// Ends the one that was idle for longest if there are too many.
  const Session& open(const std::string& user, fabric::SteadyTime now);
  /// The session, used now; nullptr if there is none, or it is over.
  const Session* find(std::string_view id, fabric::SteadyTime now);
  void close(std::string_view id);

 private:
  std::function<std::string()> secret_;
  std::map<std::string, Session, std::less<>> sessions_;
};

/// How often a password may be wrong, for a user from an address: so nobody keeps the user out from
/// elsewhere. Pure.
class Throttle {
 public:
  /// After so many wrong ones each further one takes twice the pause, up to a minute.
  static constexpr int free_tries = 3;
  static constexpr std::chrono::seconds first_pause{1};
  static constexpr std::chrono::seconds longest_pause{60};
  static constexpr std::size_t most_names = 1'000;

  struct Who {
    std::string user{};
    std::string peer{};
    auto operator<=>(const Who&) const = default;
  };

  /// How long `who` has to wait; zero: not at all, and the try counts as wrong until it succeeds,
  /// so that many at once are no more than one after the other.
  std::chrono::seconds try_now(const Who& who, fabric::SteadyTime now);
  void succeeded(const Who& who) { failures_.erase(who); }

 private:
  struct Failures {
    int count = 0;
    fabric::SteadyTime until{};
  };
  std::map<Who, Failures> failures_;
};

/// Compares in a time that tells nothing of where they differ.
bool same_secret(std::string_view one, std::string_view other);

/// The value of the cookie `name` in a header Cookie.
std::string_view cookie_in(std::string_view header, std::string_view name);

}  // namespace millrace::tools::web::actions
