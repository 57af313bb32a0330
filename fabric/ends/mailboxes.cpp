#include "fabric/ends/mailboxes.hpp"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

namespace millrace::fabric::ends {

Mailboxes::Mailboxes(const dds::Participant& participant, boost::asio::any_io_executor executor,
                     std::weak_ptr<void> owner, dds::MatchQueue& matches)
    : participant_(participant),
      executor_(std::move(executor)),
      owner_(std::move(owner)),
      matches_(matches) {}

void Mailboxes::open(const wire::Mailbox& of) {
  if (const auto known = boxes_.find(of.instance); known != boxes_.end()) {
    known->second.vanished = false;
    return;
  }
  const dds::Listener on_match(dds_create_listener(nullptr));
  matches_.listen(on_match.get());
  boxes_.try_emplace(of.instance, participant_,
                     wire::mailbox_partition(participant_.options().fabric, of.uuid, of.instance),
                     wire::EndpointOptions{.listener = on_match.get(), .batched = true});
}

void Mailboxes::on_vanished(const InstanceId& instance) {
  if (const auto mailbox = boxes_.find(instance); mailbox != boxes_.end()) {
    mailbox->second.vanished = true;
    close_if_done(mailbox);
  }
}

void Mailboxes::close_if_done(Boxes::iterator mailbox) {
  if (mailbox->second.vanished && mailbox->second.standing.empty()) {
    std::erase(unsent_, &mailbox->second);
    mailbox->second.writer.flush();
    boxes_.erase(mailbox);
  }
}

tl::expected<void, std::string> Mailboxes::publish(const Request& request) {
  const auto mailbox = boxes_.find(request.assigned);
  if (mailbox == boxes_.end()) {
    return tl::unexpected(fmt::format("instance {} has not shown up on fabric '{}'",
                                      request.assigned.to_string(), participant_.options().fabric));
  }
  auto written = mailbox->second.writer.write(request);
  if (written) {
    mailbox->second.standing.insert(key_of(request));
    wrote(mailbox->second);
  }
  return written;
}

void Mailboxes::withdraw(const RequestKey& key) {
  const auto mailbox = boxes_.find(key.instance);
  if (mailbox == boxes_.end()) {
    return;
  }
  const Request over = withdrawal_of(key);
  static_cast<void>(mailbox->second.writer.write(over));
  mailbox->second.writer.withdraw(over);
  mailbox->second.standing.erase(key);
  wrote(mailbox->second);
  close_if_done(mailbox);
}

void Mailboxes::wrote(Mailbox& mailbox) {
  if (in_turn_) {
    if (!std::exchange(mailbox.unsent, true)) {
      unsent_.push_back(&mailbox);
    }
    return;
  }
  mailbox.writer.flush();
  in_turn_ = true;
  boost::asio::post(executor_, [this, owner = owner_] {
    if (const auto alive = owner.lock()) {
      flush();
    }
  });
}

void Mailboxes::flush() {
  in_turn_ = false;
  for (Mailbox* const mailbox : unsent_) {
    mailbox->writer.flush();
    mailbox->unsent = false;
  }
  unsent_.clear();
}

}  // namespace millrace::fabric::ends
