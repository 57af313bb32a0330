// A process of another make: it speaks DDS with the types of 1.0 (1.0/idl, compiled by idlc alone)
// and has nothing of millrace.
//
//   Peer peer(domain);
//   Writer<millrace_ChannelStatus> channels(peer, "millrace");
//   channels.write(status);
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <dds/dds.h>

#include "tests/compat/alarm.h"
#include "tests/compat/data.h"
#include "tests/compat/millrace.h"
#include "tests/compat/variables.h"

namespace millrace::tests::compat {

/// No version of millrace has given this number a meaning.
inline constexpr std::uint8_t later_code = 200;
/// The extra of each sample of a later version, and its bytes.
inline constexpr std::string_view later_name = "later_name";
inline constexpr std::string_view later_bytes = "later bytes";
/// What a later version says with a code of its own; its argument is "T7".
inline constexpr std::string_view later_sentence = "a later version waits for tool T7";

millrace_Extras later_extras();
millrace_Message later_message();

using Id = std::array<std::uint8_t, 16>;
/// A version 4 UUID that differs for each `number`.
Id id_of(std::uint8_t number);
std::string text_of(const Id& id);
Id id_in(const std::string& text);

inline std::int64_t now() {
  return dds_time();
}

template <std::size_t size>
void put(char (&to)[size], std::string_view text) {
  to[text.copy(to, size - 1)] = '\0';
}
inline void put(std::uint8_t (&to)[16], const Id& id) {
  std::ranges::copy(id, to);
}
/// The sample borrows the text.
template <typename Sequence>
void put(Sequence& to, std::string_view text) {
  to._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
  to._length = to._maximum = static_cast<std::uint32_t>(text.size());
}
template <typename Sequence>
std::string text_in(const Sequence& from) {
  return {reinterpret_cast<const char*>(from._buffer), from._length};
}

/// A topic as docs/reference/wire.md has it.
struct TopicOf10 {
  const char* name;
  const dds_topic_descriptor_t* type;
  bool is_reliable = true;
  bool is_transient_local = true;
  std::int32_t depth = 1;
};
template <typename Sample>
const TopicOf10& topic_of();
#define MILLRACE_TOPIC_OF_1_0(Type) \
  template <>                       \
  const TopicOf10& topic_of<millrace_##Type>();
MILLRACE_TOPIC_OF_1_0(Request)
MILLRACE_TOPIC_OF_1_0(Reply)
MILLRACE_TOPIC_OF_1_0(Heartbeat)
MILLRACE_TOPIC_OF_1_0(ChannelStatus)
MILLRACE_TOPIC_OF_1_0(MachineStatus)
MILLRACE_TOPIC_OF_1_0(Event)
MILLRACE_TOPIC_OF_1_0(DataSample)
MILLRACE_TOPIC_OF_1_0(ProgramEvent)
MILLRACE_TOPIC_OF_1_0(Alarm)
MILLRACE_TOPIC_OF_1_0(Command)
MILLRACE_TOPIC_OF_1_0(Outcome)
MILLRACE_TOPIC_OF_1_0(VariableRequest)
MILLRACE_TOPIC_OF_1_0(VariableReply)
#undef MILLRACE_TOPIC_OF_1_0

class Peer {
 public:
  /// `announced`: the user_data of its participant.
  explicit Peer(std::uint32_t domain, const std::string& announced = {});
  ~Peer();
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  [[nodiscard]] dds_entity_t participant() const { return participant_; }

  /// Waits until a service of this UUID announces an instance, and returns its id.
  [[nodiscard]] std::string find_instance(const std::string& uuid) const;

  [[nodiscard]] dds_entity_t open_writer(const TopicOf10& topic, const std::string& partition,
                                         const std::string& user_data) const;
  [[nodiscard]] dds_entity_t open_reader(const TopicOf10& topic, const std::string& partition,
                                         const std::string& user_data) const;

 private:
  dds_entity_t domain_;
  dds_entity_t participant_;
};

inline dds_entity_t checked(dds_entity_t result, const char* what) {
  if (result < 0) {
    throw std::runtime_error(std::string(what) + ": " + dds_strretcode(result));
  }
  return result;
}

template <typename Sample>
class Writer {
 public:
  Writer(const Peer& peer, const std::string& partition, const std::string& user_data = {})
      : writer_(peer.open_writer(topic_of<Sample>(), partition, user_data)) {}
  void write(const Sample& sample) { checked(dds_write(writer_, &sample), "write a sample"); }
  /// Each matched reader has what was written, so it has matched this writer too.
  void await_acknowledgements() const {
    checked(dds_wait_for_acks(writer_, DDS_SECS(10)), "wait for acknowledgements");
  }
  [[nodiscard]] bool is_matched(std::uint32_t readers = 1) const {
    dds_publication_matched_status_t status{};
    checked(dds_get_publication_matched_status(writer_, &status), "count readers");
    return status.current_count >= readers;
  }

 private:
  dds_entity_t writer_;
};

template <typename Sample>
class Reader {
 public:
  Reader(const Peer& peer, const std::string& partition, const std::string& user_data = {})
      : reader_(peer.open_reader(topic_of<Sample>(), partition, user_data)) {}
  /// Calls `use(sample)` for each sample that is there; returns how many there were.
  template <typename Use>
  std::size_t take(Use use) {
    std::array<void*, 16> samples{};
    std::array<dds_sample_info_t, 16> infos{};
    const dds_return_t count = checked(
        dds_take(reader_, samples.data(), infos.data(), samples.size(), samples.size()), "take");
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (infos[i].valid_data) {
        use(*static_cast<const Sample*>(samples[i]));
      }
    }
    dds_return_loan(reader_, samples.data(), count);
    return static_cast<std::size_t>(count);
  }

 private:
  dds_entity_t reader_;
};

/// A service: it announces one instance, sends heartbeats, and answers each request with the
/// replies that `answer` makes of it.
class Service {
 public:
  using Answer = std::function<void(const millrace_Request&, std::vector<millrace_Reply>&)>;
  /// `announced`: further lines of the announcement.
  Service(const Peer& peer, const std::string& uuid, const std::string& announced, Answer answer);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  [[nodiscard]] static Id id() { return id_of(1); }

 private:
  void run();
  void answer(const millrace_Request& request);
  void send_heartbeat();

  Answer answer_;
  Writer<millrace_Reply> replies_;
  Writer<millrace_Heartbeat> heartbeats_;
  Reader<millrace_Request> requests_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

}  // namespace millrace::tests::compat
