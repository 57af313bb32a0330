// Sessions of logged-in users. Pure; the source of random numbers is a parameter.
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
  /// The cookie; it identifies the user.
  std::string id{};
  /// The page sends it with each action. A foreign page does not know it, even if the browser adds
  /// the cookie to that page's requests.
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

  /// `secret` draws an unpredictable text.
  explicit Sessions(std::function<std::string()> secret) : secret_(std::move(secret)) {}

  /// If there are too many, the session that was idle for longest ends.
  const Session& open(const std::string& user, fabric::SteadyTime now);
  /// The session, whose idle time starts again; nullptr if there is none, or it has expired.
  const Session* find(std::string_view id, fabric::SteadyTime now);
  void close(std::string_view id);

 private:
  std::function<std::string()> secret_;
  std::map<std::string, Session, std::less<>> sessions_;
};

/// Limits wrong passwords: by user and address, so that an attacker cannot lock the user out from
/// other addresses, and by address, so that it gains nothing by trying names in turn. Pure.
///
/// Bounded, and an attacker cannot choose what is forgotten: a failure counts until it is
/// `remembered` old. While too many are remembered, names and addresses without one must wait.
class Throttle {
 public:
  /// After so many failures each further one doubles the pause, up to a minute. Behind one address
  /// may be many users.
  static constexpr int free_tries = 3;
  static constexpr int free_tries_of_address = 30;
  static constexpr std::chrono::seconds first_pause{1};
  static constexpr std::chrono::seconds longest_pause{60};
  static constexpr std::chrono::minutes remembered{15};
  static constexpr std::size_t most_names = 4'000;

  struct Who {
    std::string user{};
    std::string peer{};
    auto operator<=>(const Who&) const = default;
  };

  /// How long `who` must wait; zero: not at all. The try counts as a failure until it succeeds, so
  /// parallel tries gain nothing.
  std::chrono::seconds try_now(const Who& who, fabric::SteadyTime now);
  void succeeded(const Who& who);

 private:
  struct Failures {
    int count = 0;
    fabric::SteadyTime last{};
    fabric::SteadyTime until{};
  };
  /// Of a user at an address; an empty user stands for all of that address.
  using Table = std::map<Who, Failures>;

  [[nodiscard]] std::chrono::seconds pause_of(const Who& who, fabric::SteadyTime now) const;
  void forget_old(fabric::SteadyTime now);
  void count(const Who& who, int free, fabric::SteadyTime now);

  Table failures_;
};

/// The value of the cookie `name` in a header Cookie.
std::string_view cookie_in(std::string_view header, std::string_view name);

}  // namespace millrace::tools::web::actions
