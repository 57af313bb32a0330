// Announces the identity of a participant, and knows the identities of the others: those that their
// certificates prove and Cyclone has checked (fabric/participant_identity.hpp has the details).
//
//   if (Authenticator* authenticator = participant.authenticator()) …                    // null without trust
//   authorization_of(authenticator->of_writer(info.publication_handle), "press_1") == Authorization::granted
//
// The CRL is read again regularly (fabric/dds/trust_watch.hpp).
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::fabric::dds {

/// From any thread. Create it before any other endpoint of its participant, and end it after them.
class Authenticator {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  /// `lease`: after this time without a packet others take the participant for gone.
  Authenticator(dds_entity_t participant, const std::string& fabric, const ProcessInfo& where,
                std::shared_ptr<const Trust> trust, std::chrono::milliseconds lease);
  ~Authenticator();
  Authenticator(const Authenticator&) = delete;
  Authenticator& operator=(const Authenticator&) = delete;

  struct Known {
    IdentityStatus status{};
    /// The participant is present.
    bool there = false;
  };
  /// A participant, by its handle in samples of built-in topics. For a while also one that is gone,
  /// whose last samples may still be untaken.
  [[nodiscard]] Known look_up(dds_instance_handle_t participant) const;
  /// The identity of the participant with this writer, which is or lately was matched with a reader
  /// that listens here.
  [[nodiscard]] IdentityStatus of_writer(dds_instance_handle_t writer) const;
  /// The identities of present participants.
  [[nodiscard]] std::vector<IdentityStatus> all() const;

  /// Makes the listener report the writers that its reader is matched with. Pass it to the reader
  /// when the reader is created.
  void listen(dds_listener_t* listener);

  /// The participant of this writer, for people: its DDS name. The writer is or lately was matched
  /// with a reader that listens here.
  [[nodiscard]] std::string name_of_writer(dds_instance_handle_t writer) const;
  /// A present participant is a proved gateway of this machine.
  [[nodiscard]] bool has_gateway_of(std::string_view machine) const;

  /// A warning about unauthorized samples, at most once a minute for each subject; the first caller
  /// takes it.
  void warn_limited(const std::string& about, const std::string& text);
  std::vector<std::string> take_warnings();

  /// Receives changes of identities: announced, gone, or revoked.
  class ChangeQueue {
   public:
    /// `changed` is called in any thread, also for warnings.
    ChangeQueue(Authenticator& authenticator, std::function<void()> changed);
    ~ChangeQueue();
    ChangeQueue(const ChangeQueue&) = delete;
    ChangeQueue& operator=(const ChangeQueue&) = delete;

    /// The participants that changed since the last call; at first all.
    std::vector<dds_instance_handle_t> take();

   private:
    friend class Authenticator;
    Authenticator& authenticator_;
    std::function<void()> changed_;
    std::vector<dds_instance_handle_t> different_;
  };

  /// Waits for identities on behalf of samples whose writers have proved nothing yet.
  class ChangeListener {
   public:
    /// `look` is called in any thread, after a participant has proved its identity, and once a
    /// second; it may destroy this object.
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
