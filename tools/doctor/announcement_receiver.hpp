// Receives multicast announcements of participants on every DDS domain without taking part: that
// finds a process of another domain, or one whose multicast arrives and whose other packets do not.
//
//   AnnouncementReceiver receiver("eth0");
//   … receiver.take();  receiver.announcements()
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/messages/message.hpp"
#include "base/posix/system.hpp"
#include "tools/doctor/announcement.hpp"

namespace millrace::tools::doctor {

struct ReceivedAnnouncement {
  Announcement who{};
  std::uint32_t domain = 0;
  /// The IPv4 address it came from.
  std::string from{};
};

class AnnouncementReceiver {
 public:
  /// Joins the group on one interface, by its name; the first packets are heard from then on. If
  /// that fails, trouble() has the reason and nothing is heard.
  explicit AnnouncementReceiver(const std::string& interface);

  /// Takes the packets that have arrived, without waiting.
  void take();

  /// Each participant once.
  [[nodiscard]] const std::map<GuidPrefix, ReceivedAnnouncement>& announcements() const {
    return announcements_;
  }
  [[nodiscard]] const base::messages::Message& trouble() const { return trouble_; }

 private:
  /// The n-th receives domain n.
  std::vector<base::posix::Fd> sockets_;
  std::map<GuidPrefix, ReceivedAnnouncement> announcements_;
  base::messages::Message trouble_;
};

}  // namespace millrace::tools::doctor
