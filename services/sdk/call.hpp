// A call for its handler.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "fabric/messages.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::sdk {

class CallSink;

/// Lives until its last owner drops it; a call without an answer is answered with the error state
/// then. All functions may be called from any thread.
class Call {
 public:
  /// `cancelled` is requested to stop when the request is withdrawn.
  Call(fabric::Request request, std::weak_ptr<CallSink> sink, std::stop_token cancelled);
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Unique for ever, the same when the call is repeated.
  [[nodiscard]] fabric::CallId id() const { return request_.call; }
  /// 1, 2, …: higher than 1 if another instance may have run the call before.
  [[nodiscard]] std::uint32_t attempt() const { return request_.attempt; }
  /// The machine and channel of the calling NC program.
  [[nodiscard]] const fabric::ChannelKey& channel() const { return request_.key; }
  /// V.G.SERVICE.UUID as the NC program wrote it.
  [[nodiscard]] const std::string& uuid() const { return request_.uuid; }
  /// V.G.SERVICE.REQUEST: at most 127 bytes in CP1252.
  [[nodiscard]] const std::string& text() const { return request_.text; }
  /// The same in UTF-8.
  [[nodiscard]] std::string utf8() const;
  /// V.G.SERVICE.REQUEST_STATE.
  [[nodiscard]] std::uint32_t state() const { return request_.state; }
  /// After this time the answer is of no use; zero = never.
  [[nodiscard]] fabric::Time deadline() const { return request_.deadline; }
  /// True if the call comes from a recording and no machine waits for it.
  [[nodiscard]] bool replayed() const { return request_.replayed; }

  /// The request with all of the above.
  [[nodiscard]] const fabric::Request& request() const { return request_; }

  /// True once no requester waits for the answer any more: REQUEST_STATE went to 0, or it, UUID or
  /// REQUEST changed. An NC reset that leaves them unchanged is not detected. A long handler checks
  /// this from time to time and may then return anything: it is not sent. It stays true: if the
  /// call is wanted again, it is handled again, as another Call.
  [[nodiscard]] bool cancelled() const { return cancelled_.stop_requested(); }
  /// The same for functions that take a token, and for a std::stop_callback. A callback runs in a
  /// thread of the SDK, must neither wait nor throw, and may answer the call.
  [[nodiscard]] std::stop_token stop_token() const { return cancelled_; }

  /// Writes an interim text and state (V.G.SERVICE.RESPONSE_STATE) for the NC program; the call
  /// continues. An NC program that waits with SysServiceWait continues too: first with `@P1=0`,
  /// which returns with this state, then with `@P1=state` as long as that is the state. A newer
  /// interim response replaces one that was not seen yet. Throws std::invalid_argument for a text
  /// that does not fit. Without effect once the call is answered or cancelled, and where NC
  /// programs wait for RESPONSE.
  void interim(const Response& response) const;

  /// Ends the call; the first answer counts. For handlers that return before they are done.
  void answer(Response response) const;
  /// Ends the call with the error state and `reason`, as an exception does.
  void fail(const std::string& reason) const;
  /// Declines the attempt: nothing of it was begun. The gateway dispatches the call to another
  /// instance and skips this one for a second, longer if it declines again. `reason` goes to logs.
  /// For calls that this instance cannot run now and another one may.
  void decline(const std::string& reason) const;

 private:
  /// Null for a call that has ended before.
  [[nodiscard]] std::shared_ptr<CallSink> end() const;

  fabric::Request request_;
  std::weak_ptr<CallSink> sink_;
  std::stop_token cancelled_;
  mutable std::atomic<bool> ended_ = false;
};

/// Answers a call by returning; an exception becomes an error answer.
using Handler = std::function<Response(const Call&)>;
/// Answers a call now or later, from any thread, by Call::answer.
using AsyncHandler = std::function<void(std::shared_ptr<const Call>)>;

/// A Handler as an AsyncHandler.
AsyncHandler as_async(Handler handler);

/// A handler whose exceptions end its call, not its process.
AsyncHandler guarded(AsyncHandler handler);

}  // namespace millrace::services::sdk
