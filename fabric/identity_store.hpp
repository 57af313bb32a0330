// The announced identities, the writers of each participant, and the revoked names. Pure.
//
//   store.add(identity_writer, participant, identity);      // as DDS matches them
//   store.matched(writer, participant);
//   store.status_of_writer(writer).identity                  // of who has it
//   store.revoke({"square-root"})                        // → the participants that it is about
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/recent.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::fabric {

class IdentityStore {
 public:
  /// Cyclone's instance handle of an endpoint or a participant; none is used twice.
  using Handle = std::uint64_t;
  /// Far more participants and writers than leave before their last samples are taken.
  static constexpr std::size_t most_departed = 1024;

  /// The writer of an identity was matched; it belongs to `participant`.
  void add(Handle writer, Handle participant, ParticipantIdentity identity);
  /// Removes the identity of this writer; returns its participant, which is remembered for a while.
  std::optional<Handle> remove(Handle writer);

  /// A writer was matched with one more reader of ours, or one less. `name`: the DDS name of its
  /// participant.
  void matched(Handle writer, Handle participant, std::string name = {});
  void unmatched(Handle writer);

  /// Revokes these names, in addition to earlier ones: a revocation is never undone. Returns the
  /// participants that are newly revoked.
  std::vector<Handle> revoke(const std::set<std::string>& names);
  /// The names that were revoked before and are missing in this list: then the list is an older
  /// one.
  [[nodiscard]] std::vector<std::string> left_out_of(const std::set<std::string>& names) const;
  [[nodiscard]] bool is_revoked(const std::string& name) const { return revoked_.contains(name); }

  /// Also of participants that left lately.
  [[nodiscard]] IdentityStatus status_of(Handle participant) const;
  [[nodiscard]] IdentityStatus status_of_writer(Handle writer) const;
  [[nodiscard]] std::string name_of_writer(Handle writer) const;
  /// A gateway of this machine, or of the machine of this queue, is present.
  [[nodiscard]] bool has_gateway_of(std::string_view machine) const;
  /// Its identity is there now.
  [[nodiscard]] bool is_there(Handle participant) const;
  /// Those that are there.
  [[nodiscard]] std::vector<Handle> participants() const;

 private:
  struct Entry {
    std::shared_ptr<const ParticipantIdentity> identity;
    bool there = true;
  };
  struct Seen {
    Handle participant = 0;
    std::string name;
    /// The number of our matched readers.
    std::size_t matched = 0;
  };

  /// Writers of identities, and whose they are.
  std::unordered_map<Handle, Handle> writers_of_identities_;
  std::unordered_map<Handle, Entry> entries_;
  std::unordered_map<Handle, Seen> writers_;
  base::Recent<Handle> left_{most_departed};
  base::Recent<Handle> left_writers_{most_departed};
  std::set<std::string> revoked_;
};

}  // namespace millrace::fabric
