// Where a part of a program says what troubles it (fabric/notice.hpp), whoever tells it to the
// fabric.
//
//   sink.raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full"});
//   sink.clear("archive", "");
#pragma once

#include <string>

#include "fabric/notice.hpp"

namespace millrace::fabric {

class NoticeSink {
 public:
  virtual ~NoticeSink() = default;
  /// Is so from now on, or is so still; `notice` names kind, and subject if there are several, and
  /// says level, text and advice.
  virtual void raise(const Notice& notice) = 0;
  /// Is not so any more. Nothing happens if it was not.
  virtual void clear(const std::string& kind, const std::string& subject) = 0;

 protected:
  NoticeSink() = default;
  NoticeSink(const NoticeSink&) = default;
  NoticeSink& operator=(const NoticeSink&) = default;
};

/// For whoever has nobody to tell.
class NoNotices final : public NoticeSink {
 public:
  void raise(const Notice& /*notice*/) override {}
  void clear(const std::string& /*kind*/, const std::string& /*subject*/) override {}
};

}  // namespace millrace::fabric
