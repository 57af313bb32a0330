// Hears what participants announce by multicast, on every DDS domain, without taking part: that is
// how a program of another domain is found, or one whose multicast comes through and whose other
// packets do not.
//
//   Hearing hearing("eth0");
//   … hearing.take();  hearing.heard()
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/doctor/announcement.hpp"

namespace millrace::tools::doctor {

struct Heard {
  Announcement who{};
  std::uint32_t domain = 0;
  /// The IPv4 address it came from.
  std::string from{};
};

class Hearing {
 public:
  /// Joins the group on one interface, by its name; the first packets are heard from then on.
  /// Where that fails, trouble() says why and nothing is heard.
  explicit Hearing(const std::string& interface);
  ~Hearing();
  Hearing(const Hearing&) = delete;
  Hearing& operator=(const Hearing&) = delete;

  /// Takes in what has arrived, without waiting.
  void take();

  /// Each participant once.
  [[nodiscard]] const std::map<GuidPrefix, Heard>& heard() const { return heard_; }
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  /// The n-th listens to domain n.
  std::vector<int> sockets_;
  std::map<GuidPrefix, Heard> heard_;
  std::string trouble_;
};

}  // namespace millrace::tools::doctor
