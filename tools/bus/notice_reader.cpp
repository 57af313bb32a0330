#include "tools/bus/notice_reader.hpp"

#include <optional>

#include "fabric/dds/post_once.hpp"
#include "fabric/observer/notices.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::tools::bus {

namespace wire = fabric::wire;

struct NoticeReader::Impl : std::enable_shared_from_this<Impl> {
  explicit Impl(NoticeListener& own_listener) : listener(own_listener) {}

  void open(const fabric::dds::Participant& participant,
            const boost::asio::any_io_executor& executor) {
    post.emplace(executor, weak_from_this(), [this] { take(); });
    const fabric::dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, participant.options().fabric, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_data.get()});
  }

  void take() {
    while (reader) {
      auto batch = reader->take();
      if (batch.empty()) {
        return;
      }
      for (wire::Taken<fabric::Notice>& taken : batch) {
        auto kept = owners.take(taken.value.key, taken.writer, taken.valid,
                                taken.presence == wire::Presence::alive);
        if (!kept) {
          continue;
        }
        taken.value.key = std::move(kept->key);
        kept->is_over ? listener.on_notice_gone(taken.value.key) : listener.on_notice(taken.value);
      }
      for (const fabric::NoticeKey& key : owners.gone(reader->matched())) {
        listener.on_notice_gone(key);
      }
    }
  }

  NoticeListener& listener;
  fabric::observer::NoticeOwners owners;
  // Before the reader that wakes it.
  std::optional<fabric::dds::PostOnce> post;
  std::optional<wire::Reader<fabric::Notice>> reader;
};

NoticeReader::NoticeReader(const fabric::dds::Participant& participant,
                           const boost::asio::any_io_executor& executor, NoticeListener& listener)
    : impl_(std::make_shared<Impl>(listener)) {
  impl_->open(participant, executor);
}

NoticeReader::~NoticeReader() {
  impl_->reader.reset();
}

}  // namespace millrace::tools::bus
