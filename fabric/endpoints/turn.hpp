// When the requests that a gateway writes are sent: those of one turn together, so that the ones to
// an instance share a datagram. Pure.
//
//   Turn turn;
//   const bool begins = !turn.running();
//   if (turn.on_written()) flush();            // a single call must not wait
//   if (begins) await_round();                 // post to the executor
//   …
//   if (turn.on_round()) flush(); else await_round();
#pragma once

#include <cstddef>
#include <utility>

namespace millrace::fabric::endpoints {

/// It begins with a request, and ends when the executor comes back without a further one: while
/// replies lead to new requests, these wait for each other.
class Turn {
 public:
  /// A turn ends after this many rounds of the executor, so that no request waits for longer.
  static constexpr unsigned most_rounds = 8;

  [[nodiscard]] bool running() const { return written_ > 0; }

  /// A request was written. True: it is the first one and is sent at once, unless the last turn had
  /// several. False: it waits for the end of the turn.
  bool on_written() {
    const bool at_once = ++written_ == 1 && !busy_;
    waits_ = waits_ || !at_once;
    quiet_ = false;
    return at_once;
  }

  /// The executor came back. True: the turn is over, and what waits is to be sent.
  bool on_round() {
    if (waits_ && !std::exchange(quiet_, true) && ++rounds_ < most_rounds) {
      return false;
    }
    *this = Turn(written_ > 1);
    return true;
  }

  Turn() = default;

 private:
  explicit Turn(bool busy) : busy_(busy) {}

  /// The last turn had several requests.
  bool busy_ = false;
  std::size_t written_ = 0;
  /// A request waits for the end of the turn.
  bool waits_ = false;
  /// None was written since the executor last came back.
  bool quiet_ = false;
  unsigned rounds_ = 0;
};

}  // namespace millrace::fabric::endpoints
