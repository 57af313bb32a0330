// Finds requests in a channel: REQUEST_STATE, then the texts, then all of them again; after a
// notification, all of them twice.
//
//   RequestReader reader;
//   reader.read_whole();                                   // the controller notifies a change
//   if (auto request = reader.on_read(snapshot)) …     // read as reader.reads() said
//
// The program writes UUID and REQUEST before REQUEST_STATE, so the state is its publish flag. The
// reads are separate ADS calls, so state and texts are taken for one request only if they read the
// same twice, the second time after a state that was not 0. The states alone prove nothing: a
// program that gives up a request and makes the next one may set the same state again while its
// texts are half written.
#pragma once

#include <optional>

#include "gateway/moment.hpp"
#include "gateway/policy.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::channel {

/// A request that the gateway has skipped; it stands until it changes.
struct Unserved {
  PendingRequest request;
  fabric::Message reason;
  SteadyTime since{};
  Policy policy;
  /// It is to be found once more.
  bool again = false;
  /// It has waited for as long as its policy says.
  bool overdue = false;
};

class RequestReader {
 public:
  /// The variables to read next.
  [[nodiscard]] ReadSet reads() const;
  /// A request is being read: the next read is due at once.
  [[nodiscard]] bool reading() const { return step_ != Step::state && step_ != Step::whole; }

  /// The request, once it is read and nothing moved in between. With `with_texts` false a state
  /// that has not changed since leave_unserved() is not read whole.
  std::optional<PendingRequest> on_read(const ServiceSnapshot& snapshot, bool with_texts = true);

  /// The next read decides whether what the one before has shown is a whole request.
  [[nodiscard]] bool confirming() const { return step_ == Step::confirm; }

  /// This request is skipped; it is not found again until it changes. False if it was skipped for
  /// this reason before.
  bool leave_unserved(PendingRequest request, const fabric::Message& reason, const Policy& policy,
                      SteadyTime now);
  [[nodiscard]] const std::optional<Unserved>& unserved() const { return unserved_; }
  /// The skipped request has waited for as long as its policy says, and was not offered since.
  [[nodiscard]] bool deadline_passes(SteadyTime now) const;
  /// Finds the skipped request once more. False if there is none.
  bool offer_again(bool overdue);
  /// There may be a request now: the next read covers all variables. For an idle channel the state
  /// is enough, but this saves one read of three if there is a request.
  void read_whole();
  /// Drops a half-read request.
  void restart() { step_ = Step::state; }

 private:
  enum class Step { state, whole, texts, confirm };

  void start(const ServiceSnapshot& snapshot, bool with_texts);

  Step step_ = Step::state;
  PendingRequest found_;
  std::optional<Unserved> unserved_;
};

}  // namespace millrace::gateway::channel
