// Shows the identity of a participant, and knows those of the others: what each has proved to be,
// by the certificate that Cyclone has checked (fabric/participant_identity.hpp says how).
//
//   if (Authenticator* authenticator = participant.authenticator()) …                    // null without trust
//   authorization_of(authenticator->of_writer(info.publication_handle), "press_1") == Authorization::granted
//
// Whom the authority has taken back since is looked at again and again
// (fabric/dds/trust_watch.hpp).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/trust.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::fabric::dds {

/// From any thread. To be made before any other endpoint of its participant, and to outlive them.
class Authenticator {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  Authenticator(dds_entity_t participant, const std::string& fabric, const ProcessInfo& where,
                std::shared_ptr<const Trust> trust);
  ~Authenticator();
  Authenticator(const Authenticator&) = delete;
  Authenticator& operator=(const Authenticator&) = delete;

  struct Known {
    IdentityStatus status{};
    /// Its identity is there now.
    bool there = false;
  };
  /// Of a participant, by the handle that samples of built-in topics have. Of one that is gone,
  /// too, for a while: its last words may be untaken.
  [[nodiscard]] Known look_up(dds_instance_handle_t participant) const;
  /// Of who has this writer: one that is, or was lately, matched with a reader that listens here.
  [[nodiscard]] IdentityStatus of_writer(dds_instance_handle_t writer) const;
  /// Those that are there now.
  [[nodiscard]] std::vector<IdentityStatus> all() const;

  /// Has a reader tell of the writers that it is matched with. To be given to it when it is
  /// created.
  void listen(dds_listener_t* listener);

  /// The program of this writer, for people: what DDS calls it. Of one that is matched with a
  /// reader that listens here, or was lately.
  [[nodiscard]] std::string name_of_writer(dds_instance_handle_t writer) const;
  /// A program that is there has proved to be a gateway of this machine.
  [[nodiscard]] bool has_gateway_of(std::string_view machine) const;

  /// What is not believed is said once a minute, by whoever takes it first.
  void warn_limited(const std::string& about, const std::string& text);
  std::vector<std::string> take_warnings();

  /// Who wants to know when somebody has shown an identity, is gone, or is believed no more.
  class ChangeQueue {
   public:
    /// `changed` is called in any thread, also for warnings.
    ChangeQueue(Authenticator& authenticator, std::function<void()> changed);
    ~ChangeQueue();
    ChangeQueue(const ChangeQueue&) = delete;
    ChangeQueue& operator=(const ChangeQueue&) = delete;

    /// The participants of whom something is different since the last call; at first all.
    std::vector<dds_instance_handle_t> take();

   private:
    friend class Authenticator;
    Authenticator& authenticator_;
    std::function<void()> changed_;
    std::vector<dds_instance_handle_t> different_;
  };

  /// Who has something in hand whose writer has proved nothing yet.
  class ChangeListener {
   public:
    /// `look` is called in any thread, after somebody has proved what it is, and once a second; it
    /// may end this object.
    ChangeListener(Authenticator& authenticator, std::function<void()> look);
    ~ChangeListener();
    ChangeListener(const ChangeListener&) = delete;
    ChangeListener& operator=(const ChangeListener&) = delete;

   private:
    friend class Authenticator;
    Authenticator& authenticator_;
    std::function<void()> look_;
  };

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::dds
