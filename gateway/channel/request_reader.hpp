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

#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::channel {

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

  /// This request is skipped; it is not reported again until it changes.
  void leave_unserved(PendingRequest request);
  [[nodiscard]] const std::optional<PendingRequest>& unserved() const { return unserved_; }
  /// Reports the ignored request once more.
  void offer_again() { again_ = true; }
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
  std::optional<PendingRequest> unserved_;
  bool again_ = false;
};

}  // namespace millrace::gateway::channel
