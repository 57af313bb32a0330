// Where an exception would have nobody to catch it: in the callbacks of C libraries, in threads
// that are not ours, in coroutines that nobody waits for.
//
//   dds_lset_data_available_arg(
//       listener,
//       [](dds_entity_t, void* self) noexcept {
//         contain("waking for data", [&] { static_cast<Reader*>(self)->wake(); });
//       }, …);
//   asio::co_spawn(executor, accept(self), rethrow_from_loop);      // not asio::detached
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <string_view>

namespace millrace::base::program {

/// Reports that `error` has ended what `where` names. A line in the log (make_log), or on standard
/// error as long as there is none: the first one of each place, then the 2nd, 4th, 8th …
void report_contained(std::string_view where, const std::exception_ptr& error) noexcept;

/// Where report_contained writes from now on; false if the log is gone. From any thread. Called
/// without a lock held, possibly by several threads.
void report_contained_to(std::function<bool(const std::string& line)> report);

/// Does `work`. What it throws is reported and goes no further: into C code that cannot be unwound,
/// or out of a thread that others need.
template <typename Work>
void contain(std::string_view where, const Work& work) noexcept {
  try {
    work();
  } catch (...) {
    report_contained(where, std::current_exception());
  }
}

/// For co_spawn in place of asio::detached, which drops exceptions: what leaves the coroutine comes
/// out of the run() of its event loop and ends the program, with a message.
inline void rethrow_from_loop(const std::exception_ptr& error) {
  if (error) {
    std::rethrow_exception(error);
  }
}

}  // namespace millrace::base::program
