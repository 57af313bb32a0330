// The recordings of a folder: a list, and the content of one. Files outside the folder are never
// read, whatever their name. Blocks: not for the loop's thread.
//
//   const Recordings recordings("/var/lib/millrace/recorder");
//   recordings.list()
//   recordings.calls("millrace-20260301T070000Z.mcap", {.failed = true}, 0, 200)
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include <boost/json/object.hpp>
#include <tl/expected.hpp>

#include "fabric/messages.hpp"
#include "tools/mcap/file.hpp"
#include "tools/web/http/message.hpp"
#include "tools/web/plant/call_store.hpp"

namespace millrace::tools::web::http {

class Recordings {
 public:
  /// The reason, for people, and the HTTP status.
  struct Refusal {
    unsigned status = 404;
    std::string what{};
  };
  template <typename Value>
  using Result = tl::expected<Value, Refusal>;

  explicit Recordings(std::filesystem::path folder, plant::NormalStates normal = {})
      : folder_(std::move(folder)), normal_(std::move(normal)) {}

  /// {recordings: [{name, size, modified, …}]}, the newest first. The newest 200
  /// also have what their files contain without being read whole: machines, start, end, calls,
  /// failed. A file that is not finished has `writing`: whether a recorder still writes it.
  [[nodiscard]] Result<boost::json::object> list() const;
  /// As `recording info --hops --json`; reads the whole file.
  [[nodiscard]] Result<boost::json::object> info(const std::string& name) const;
  /// {calls, more}: calls that match `filter`, ordered by their end; skips the first `skip`,
  /// returns at most `most`.
  [[nodiscard]] Result<boost::json::object> calls(const std::string& name,
                                                  const plant::CallFilter& filter, std::size_t skip,
                                                  std::size_t most) const;
  /// {alarms, more}: the recorded alarms in the order of the file, at most `most`, as `recording
  /// cat
  /// --kind alarm --json` prints them.
  [[nodiscard]] Result<boost::json::object> alarms(const std::string& name, std::size_t most) const;
  /// As `recording calls --json FILE CALL`.
  [[nodiscard]] Result<boost::json::object> timeline(const std::string& name,
                                                     const fabric::CallId& call) const;
  [[nodiscard]] Result<Download> download(const std::string& name) const;

  /// Ends the present and all further reading at once. From any thread.
  void stop() { *stopped_ = true; }

 private:
  [[nodiscard]] Result<base::posix::Fd> open(const std::string& name) const;
  [[nodiscard]] Result<mcap::FileSource> source(const std::string& name) const;

  std::filesystem::path folder_;
  plant::NormalStates normal_;
  std::shared_ptr<std::atomic<bool>> stopped_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace millrace::tools::web::http
