// A typed DDS reader of one partition or a pattern of them.
//
//   Reader<Event> events(participant, "millrace", Keep::all, {.listener = listener.get()});
//   for (const Taken<Event>& taken : events.take()) …
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/recent.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/wire/authorizer.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/wire/endpoint.hpp"
#include "fabric/wire/key_limit.hpp"

namespace millrace::fabric::wire {

/// What DDS reports about the key of a sample when it is taken.
enum class InstanceState {
  alive,
  /// The writer withdrew it.
  disposed,
  /// The writer is gone, or counts as gone.
  no_writers
};

template <typename Value>
struct Taken {
  Value value;
  /// False if only the key of `value` is valid: news about its state.
  bool valid = false;
  InstanceState instance_state = InstanceState::alive;
  /// The writer, as in the samples of DCPSPublication: from DDS, not from the sample.
  dds_instance_handle_t writer = DDS_HANDLE_NIL;
  /// Whether its writer may publish this, with trust. Readers with
  /// EndpointOptions::deliver_unauthorized return unauthorized samples, all others log and drop
  /// them. A sample of a writer without a proved identity waits until it has one, or for two
  /// seconds.
  Authorization authorization = Authorization::granted;
};

/// RAII; the constructor throws std::runtime_error with Cyclone's reason.
template <typename Value>
class Reader {
 public:
  Reader(const dds::Participant& participant, const std::string& partition, Keep keep,
         const EndpointOptions& options = {});

  /// Up to 64 samples; call it until it returns none.
  std::vector<Taken<Value>> take();

  /// Changes the reader's user_data in discovery.
  void set_user_data(const std::string& user_data);

  /// Samples that writers overwrote or dropped before they arrived here, since the start.
  [[nodiscard]] std::uint32_t lost() const;

  /// Waits until its listener has finished, and never calls it again.
  void silence();

  /// Handles of the writers that are matched, as in the samples of DCPSPublication.
  [[nodiscard]] std::vector<dds_instance_handle_t> matched() const;

  [[nodiscard]] const Authorizer& authorizer() const { return authorizer_; }

  /// For the log, if samples were dropped because a writer has too many keys (Topic::most_keys): a
  /// line for each such writer; call it until it returns none.
  std::optional<std::string> take_flooding();
  /// The DDS name of a writer's participant.
  [[nodiscard]] std::string program_of(dds_instance_handle_t writer) const {
    return wire::program_of(reader_, writer);
  }
  /// Whether the participant of a writer made the id, as far as it is still there.
  [[nodiscard]] bool made_id(dds_instance_handle_t writer, const InstanceId& id) const {
    return wire::made_id(reader_, writer, id);
  }
  /// The participant of a writer, as in samples of built-in topics; nil if it left before it was
  /// known.
  dds_instance_handle_t participant_of(dds_instance_handle_t writer);

 private:
  /// Samples of writers without a proved identity; with trust only.
  struct UnauthenticatedSamples {
    using Clock = std::chrono::steady_clock;
    struct One {
      Taken<Value> taken;
      Clock::time_point until;
    };
    /// A stranger may write any number of samples. Further ones displace the first.
    static constexpr std::size_t most = 256;
    /// A process announces its identity first; another vendor's may come later.
    static constexpr std::chrono::seconds authentication_timeout{2};

    std::deque<One> samples;
    std::atomic<bool> any = false;
    std::optional<dds::Authenticator::ChangeListener> change_listener;
  };

  static std::unique_ptr<KeyLimit> limit_of(std::size_t most) {
    return most > 0 ? std::make_unique<KeyLimit>(most) : nullptr;
  }
  /// Whether it can be returned now.
  bool authorize(Taken<Value>& taken);
  void drop(const Taken<Value>& taken);
  /// Evaluates what a sample that was taken after `before` shows about its key.
  void note_key(const dds_sample_info_t& info, std::uint64_t before);
  void take_unauthenticated(std::vector<Taken<Value>>& taken);

  Authorizer authorizer_;
  bool deliver_unauthorized_;
  /// Null without trust.
  std::unique_ptr<UnauthenticatedSamples> unauthenticated_;
  /// Null without a limit.
  std::unique_ptr<KeyLimit> limit_;
  dds::Entity topic_;
  dds::Entity subscriber_;
  dds_entity_t reader_ = 0;
  /// By writer; far more than there are at a time.
  base::Recent<dds_instance_handle_t, dds_instance_handle_t, std::hash<dds_instance_handle_t>>
      participants_{16'384};
};

/// Gives samples back to Cyclone, also if their use throws.
struct Loan {
  dds_entity_t reader;
  void** samples;
  dds_return_t count;
  ~Loan() { dds_return_loan(reader, samples, count); }
};

/// Takes samples that Cyclone lends and hands each to `use(const Sample&, const
/// dds_sample_info_t&)`. Returns how many there were, at most 64.
template <typename Sample, typename Use>
std::size_t take_lent(dds_entity_t reader, Use use) {
  constexpr std::size_t batch = 64;
  std::array<void*, batch> samples{};
  std::array<dds_sample_info_t, batch> infos{};
  const dds_return_t count = dds_take(reader, samples.data(), infos.data(), batch, batch);
  if (count <= 0) {
    return 0;
  }
  const auto size = static_cast<std::size_t>(count);
  const Loan loan{reader, samples.data(), count};
  for (std::size_t i = 0; i < size; ++i) {
    use(*static_cast<const Sample*>(samples[i]), infos[i]);
  }
  return size;
}

inline InstanceState instance_state_of(const dds_sample_info_t& info) {
  switch (info.instance_state) {
    case DDS_IST_NOT_ALIVE_DISPOSED:
      return InstanceState::disposed;
    case DDS_IST_NOT_ALIVE_NO_WRITERS:
      return InstanceState::no_writers;
    default:
      return InstanceState::alive;
  }
}

template <typename Value>
Reader<Value>::Reader(const dds::Participant& participant, const std::string& partition, Keep keep,
                      const EndpointOptions& options)
    : authorizer_(participant),
      deliver_unauthorized_(options.deliver_unauthorized),
      limit_(limit_of(Codec<Value>::topic().most_keys)),
      topic_(create_topic(participant, Codec<Value>::topic())),
      subscriber_(create_subscriber(participant, partition)) {
  if (limit_) {
    limit_->watch(topic_);
  }
  reader_ = dds::check(dds_create_reader(subscriber_.handle(), topic_.handle(),
                                         reader_qos(Codec<Value>::topic(), keep, options).get(),
                                         reader_listener(participant, options, limit_.get()).get()),
                       fmt::format("read {} in {}", Codec<Value>::topic().name, partition));
  if (!authorizer_.enabled()) {
    return;
  }
  unauthenticated_ = std::make_unique<UnauthenticatedSamples>();
  dds_on_data_available_fn on_data = nullptr;
  void* who = nullptr;
  if (options.listener != nullptr) {
    dds_lget_data_available_arg(options.listener, &on_data, &who, nullptr);
  }
  if (on_data != nullptr) {
    unauthenticated_->change_listener.emplace(
        *authorizer_.authenticator(),
        [unauthenticated = unauthenticated_.get(), on_data, who, id = reader_] {
          if (unauthenticated->any) {
            on_data(id, who);
          }
        });
  }
}

template <typename Value>
void Reader<Value>::silence() {
  dds_set_listener(reader_, nullptr);
  if (unauthenticated_) {
    unauthenticated_->change_listener.reset();
  }
}

template <typename Value>
bool Reader<Value>::authorize(Taken<Value>& taken) {
  taken.authorization = authorizer_.authorize(taken.writer, authorization_scope_of(taken.value));
  if (taken.authorization == Authorization::granted) {
    apply_certificate(taken.value, authorizer_, taken.writer);
    return true;
  }
  return false;
}

template <typename Value>
void Reader<Value>::drop(const Taken<Value>& taken) {
  if (!deliver_unauthorized_) {
    authorizer_.warn_limited(taken.writer, authorization_scope_of(taken.value),
                             Codec<Value>::topic().name);
  }
}

template <typename Value>
void Reader<Value>::note_key(const dds_sample_info_t& info, std::uint64_t before) {
  const InstanceState instance_state = instance_state_of(info);
  if (instance_state == InstanceState::no_writers) {
    limit_->forget(info.instance_handle, before);
  } else if (instance_state == InstanceState::disposed && !info.valid_data) {
    // Cyclone does not ask the filter about a key that is disposed without a sample.
    limit_->admits(info.publication_handle, info.instance_handle);
  }
}

/// Samples that are proved by now, and those that have waited for too long.
template <typename Value>
void Reader<Value>::take_unauthenticated(std::vector<Taken<Value>>& taken) {
  const auto now = UnauthenticatedSamples::Clock::now();
  std::erase_if(unauthenticated_->samples, [&](auto& sample) {
    if (authorize(sample.taken)) {
      taken.push_back(std::move(sample.taken));
      return true;
    }
    const bool over =
        sample.taken.authorization != Authorization::unauthenticated || sample.until <= now;
    if (over) {
      drop(sample.taken);
      if (deliver_unauthorized_) {
        taken.push_back(std::move(sample.taken));
      }
    }
    return over;
  });
  unauthenticated_->any = !unauthenticated_->samples.empty();
}

template <typename Value>
std::vector<Taken<Value>> Reader<Value>::take() {
  std::vector<Taken<Value>> taken;
  if (unauthenticated_ && unauthenticated_->any) {
    take_unauthenticated(taken);
  }
  std::size_t count = 0;
  // Nothing is left only if nothing was there.
  do {
    const std::uint64_t before = limit_ ? limit_->admitted() : 0;
    count = take_lent<typename Codec<Value>::Sample>(
        reader_, [&](const auto& sample, const dds_sample_info_t& info) {
          Taken<Value> received{Codec<Value>::decode(sample), info.valid_data,
                                instance_state_of(info), info.publication_handle};
          if (limit_) {
            note_key(info, before);
          }
          if (!authorizer_.enabled() || authorize(received)) {
            taken.push_back(std::move(received));
          } else if (received.authorization == Authorization::unauthenticated) {
            unauthenticated_->samples.push_back(
                {std::move(received), UnauthenticatedSamples::Clock::now() +
                                          UnauthenticatedSamples::authentication_timeout});
            unauthenticated_->any = true;
            if (unauthenticated_->samples.size() > UnauthenticatedSamples::most) {
              drop(unauthenticated_->samples.front().taken);
              unauthenticated_->samples.pop_front();
            }
          } else {
            drop(received);
            if (deliver_unauthorized_) {
              taken.push_back(std::move(received));
            }
          }
        });
  } while (taken.empty() && count > 0);
  return taken;
}

template <typename Value>
std::optional<std::string> Reader<Value>::take_flooding() {
  const auto writer = limit_ ? limit_->take_flooding() : std::nullopt;
  if (!writer) {
    return std::nullopt;
  }
  // It may have left by now.
  const std::string program = authorizer_.enabled()
                                  ? authorizer_.authenticator()->name_of_writer(*writer)
                                  : limit_->name_of(*writer);
  return fmt::format(
      "participant {} writes more than {} DDS instances on {}: further ones are dropped",
      program.empty() ? program_of(*writer) : program, limit_->most(), Codec<Value>::topic().name);
}

template <typename Value>
dds_instance_handle_t Reader<Value>::participant_of(dds_instance_handle_t writer) {
  if (const dds_instance_handle_t* const known = participants_.use(writer)) {
    return *known;
  }
  participants_.put(writer, wire::participant_of(reader_, writer));
  return participants_.newest();
}

template <typename Value>
void Reader<Value>::set_user_data(const std::string& user_data) {
  const dds::Qos qos(dds_create_qos());
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  dds::check(dds_set_qos(reader_, qos.get()), "change user data");
}

template <typename Value>
std::uint32_t Reader<Value>::lost() const {
  dds_sample_lost_status_t status{};
  dds::check(dds_get_sample_lost_status(reader_, &status), "count lost samples");
  return status.total_count;
}

template <typename Value>
std::vector<dds_instance_handle_t> Reader<Value>::matched() const {
  return matched_endpoints(reader_, &dds_get_matched_publications);
}

}  // namespace millrace::fabric::wire
