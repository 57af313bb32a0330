// Hears what programs say of themselves.
//
//   NoticeReader notices(participant, io.get_executor(), listener);
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/notice.hpp"

namespace millrace::tools::bus {

/// Called on the executor, one at a time.
class NoticeListener {
 public:
  virtual ~NoticeListener() = default;
  /// It is said for the first time, or again.
  virtual void on_notice(const fabric::Notice& notice) = 0;
  /// It is taken back, or who has said it is gone.
  virtual void on_notice_gone(const fabric::NoticeKey& key) = 0;
};

class NoticeReader {
 public:
  /// `participant` and `listener` outlive it. Throws std::runtime_error with Cyclone's reason.
  NoticeReader(const fabric::dds::Participant& participant,
               const boost::asio::any_io_executor& executor, NoticeListener& listener);
  ~NoticeReader();
  NoticeReader(const NoticeReader&) = delete;
  NoticeReader& operator=(const NoticeReader&) = delete;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::tools::bus
