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
#include <unordered_map>
#include <vector>

#include <fmt/format.h>

#include "fabric/dds/badges.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/wire/endpoint.hpp"
#include "fabric/wire/key_limit.hpp"
#include "fabric/wire/witness.hpp"

namespace millrace::fabric::wire {

/// What DDS says about the key of a sample at the moment it is taken.
enum class Presence {
  alive,
  /// The writer took it back.
  withdrawn,
  /// The writer is gone, or is taken for gone.
  orphaned
};

template <typename Value>
struct Taken {
  Value value;
  /// False if only the key of `value` means something: news of its presence.
  bool valid = false;
  Presence presence = Presence::alive;
  /// Who has sent it, as in the samples of DCPSPublication: what DDS says, whatever the sample
  /// does.
  dds_instance_handle_t writer = DDS_HANDLE_NIL;
  /// Whether its writer may say so, where there is trust. What is not believed is handed out by
  /// readers that ask for it (EndpointOptions::doubtful), and told of and dropped by the others.
  /// What comes from a writer that has proved nothing waits until it has, or for two seconds.
  Standing standing = Standing::believed;
};

/// RAII; the constructor throws std::runtime_error with Cyclone's reason.
template <typename Value>
class Reader {
 public:
  Reader(const dds::Participant& participant, const std::string& partition, Keep keep,
         const EndpointOptions& options = {});

  /// Up to 64 samples; call it until it returns none.
  std::vector<Taken<Value>> take();

  /// Changes what discovery tells of the reader.
  void set_user_data(const std::string& user_data);

  /// Samples that writers overwrote or dropped before they arrived here, since the start.
  [[nodiscard]] std::uint32_t lost() const;

  /// Waits until its listener has ended what it does, and never calls it again.
  void silence();

  /// Handles of the writers that are matched, as in the samples of DCPSPublication.
  [[nodiscard]] std::vector<dds_instance_handle_t> matched() const;

  [[nodiscard]] const Witness& witness() const { return witness_; }

  /// For the log, if samples of too many keys of a writer were dropped since the last call
  /// (Topic::most_keys).
  std::optional<std::string> take_flooding();
  /// What DDS calls the program of a writer.
  [[nodiscard]] std::string program_of(dds_instance_handle_t writer) const {
    return wire::program_of(reader_, writer);
  }
  /// The participant of a writer, as samples of built-in topics name it; nil if it has left before
  /// it was asked for.
  dds_instance_handle_t participant_of(dds_instance_handle_t writer);

 private:
  /// What was taken of writers that have proved nothing yet; with trust only.
  struct Aside {
    using Clock = std::chrono::steady_clock;
    struct One {
      Taken<Value> taken;
      Clock::time_point until;
    };
    /// A stranger may say any number of things. More push out the first.
    static constexpr std::size_t most = 256;
    /// A program shows its badge first; another vendor's may come later.
    static constexpr std::chrono::seconds proof_time{2};

    std::deque<One> samples;
    std::atomic<bool> any = false;
    std::optional<dds::Badges::Waiter> waiter;
  };

  static std::unique_ptr<KeyLimit> limit_of(std::size_t most) {
    return most > 0 ? std::make_unique<KeyLimit>(most) : nullptr;
  }
  /// Whether it is to be handed out now.
  bool judge(Taken<Value>& taken);
  void drop(const Taken<Value>& taken);
  /// What a sample that was taken after `before` says of its key.
  void note_key(const dds_sample_info_t& info, std::uint64_t before);
  void take_from_aside(std::vector<Taken<Value>>& taken);

  Witness witness_;
  bool doubtful_;
  /// Null without trust.
  std::unique_ptr<Aside> aside_;
  /// Null without a limit.
  std::unique_ptr<KeyLimit> limit_;
  dds::Entity topic_;
  dds::Entity subscriber_;
  dds_entity_t reader_ = 0;
  /// By writer.
  std::unordered_map<dds_instance_handle_t, dds_instance_handle_t> participants_;
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

inline Presence presence_of(const dds_sample_info_t& info) {
  switch (info.instance_state) {
    case DDS_IST_NOT_ALIVE_DISPOSED:
      return Presence::withdrawn;
    case DDS_IST_NOT_ALIVE_NO_WRITERS:
      return Presence::orphaned;
    default:
      return Presence::alive;
  }
}

template <typename Value>
Reader<Value>::Reader(const dds::Participant& participant, const std::string& partition, Keep keep,
                      const EndpointOptions& options)
    : witness_(participant),
      doubtful_(options.doubtful),
      limit_(limit_of(Codec<Value>::topic().most_keys)),
      topic_(create_topic(participant, Codec<Value>::topic())),
      subscriber_(create_subscriber(participant, partition)) {
  if (limit_) {
    limit_->watch(topic_);
  }
  reader_ = dds::check(dds_create_reader(subscriber_.handle(), topic_.handle(),
                                         reader_qos(Codec<Value>::topic(), keep, options).get(),
                                         reader_listener(participant, options).get()),
                       fmt::format("read {} in {}", Codec<Value>::topic().name, partition));
  if (!witness_.asks()) {
    return;
  }
  aside_ = std::make_unique<Aside>();
  dds_on_data_available_fn on_data = nullptr;
  void* who = nullptr;
  if (options.listener != nullptr) {
    dds_lget_data_available_arg(options.listener, &on_data, &who, nullptr);
  }
  if (on_data != nullptr) {
    aside_->waiter.emplace(*witness_.badges(), [aside = aside_.get(), on_data, who, id = reader_] {
      if (aside->any) {
        on_data(id, who);
      }
    });
  }
}

template <typename Value>
void Reader<Value>::silence() {
  dds_set_listener(reader_, nullptr);
  if (aside_) {
    aside_->waiter.reset();
  }
}

template <typename Value>
bool Reader<Value>::judge(Taken<Value>& taken) {
  taken.standing = witness_.judge(taken.writer, claim_of(taken.value));
  if (taken.standing == Standing::believed) {
    apply_certificate(taken.value, witness_, taken.writer);
    return true;
  }
  return false;
}

template <typename Value>
void Reader<Value>::drop(const Taken<Value>& taken) {
  if (!doubtful_) {
    witness_.complain(taken.writer, claim_of(taken.value), Codec<Value>::topic().name);
  }
}

template <typename Value>
void Reader<Value>::note_key(const dds_sample_info_t& info, std::uint64_t before) {
  const Presence presence = presence_of(info);
  if (presence == Presence::orphaned) {
    limit_->forget(info.instance_handle, before);
  } else if (presence == Presence::withdrawn && !info.valid_data) {
    // Cyclone asks no filter whether it is to keep a key that is disposed without a sample.
    limit_->admits(info.publication_handle, info.instance_handle);
  }
}

/// What is proved by now, and what has waited for too long.
template <typename Value>
void Reader<Value>::take_from_aside(std::vector<Taken<Value>>& taken) {
  const auto now = Aside::Clock::now();
  std::erase_if(aside_->samples, [&](auto& one) {
    if (judge(one.taken)) {
      taken.push_back(std::move(one.taken));
      return true;
    }
    const bool over = one.taken.standing != Standing::unproven || one.until <= now;
    if (over) {
      drop(one.taken);
      if (doubtful_) {
        taken.push_back(std::move(one.taken));
      }
    }
    return over;
  });
  aside_->any = !aside_->samples.empty();
}

template <typename Value>
std::vector<Taken<Value>> Reader<Value>::take() {
  std::vector<Taken<Value>> taken;
  if (aside_ && aside_->any) {
    take_from_aside(taken);
  }
  std::size_t count = 0;
  // Nothing is left only if nothing was there.
  do {
    const std::uint64_t before = limit_ ? limit_->admitted() : 0;
    count = take_lent<typename Codec<Value>::Sample>(
        reader_, [&](const auto& sample, const dds_sample_info_t& info) {
          Taken<Value> one{Codec<Value>::decode(sample), info.valid_data, presence_of(info),
                           info.publication_handle};
          if (limit_) {
            note_key(info, before);
          }
          if (!witness_.asks() || judge(one)) {
            taken.push_back(std::move(one));
          } else if (one.standing == Standing::unproven) {
            aside_->samples.push_back({std::move(one), Aside::Clock::now() + Aside::proof_time});
            aside_->any = true;
            if (aside_->samples.size() > Aside::most) {
              drop(aside_->samples.front().taken);
              aside_->samples.pop_front();
            }
          } else {
            drop(one);
            if (doubtful_) {
              taken.push_back(std::move(one));
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
  return fmt::format("participant {} tells of more than {} things on {}: further ones are dropped",
                     program_of(*writer), limit_->most(), Codec<Value>::topic().name);
}

template <typename Value>
dds_instance_handle_t Reader<Value>::participant_of(dds_instance_handle_t writer) {
  // Far more than there are at a time; those that are there are asked for again.
  constexpr std::size_t most = 16'384;
  if (participants_.size() > most) {
    participants_.clear();
  }
  const auto [known, is_new] = participants_.try_emplace(writer, DDS_HANDLE_NIL);
  if (is_new) {
    known->second = wire::participant_of(reader_, writer);
  }
  return known->second;
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
