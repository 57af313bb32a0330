#include "services/lcm/bridge.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <millrace/drain_t.hpp>

#include "base/text/quoted.hpp"
#include "fabric/lcm/message.hpp"
#include "services/lcm/received.hpp"

namespace millrace::services::lcm {

namespace {

using fabric::SteadyTime;

Publish drain_of(const std::string& uuid, std::int64_t program) {
  drain_t message{};
  message.program = program;
  return {channel_of(drain_prefix, uuid), fabric::lcm::encode(message)};
}

bool is_ours(std::string_view channel) {
  return channel == presence_channel || channel.starts_with(reply_prefix);
}

}  // namespace

std::string program_name(std::int64_t program) {
  return fmt::format("program {:016x}", static_cast<std::uint64_t>(program));
}

std::string Sender::to_string() const {
  return fmt::format("{}.{}.{}.{}:{}", address >> 24U, (address >> 16U) & 0xFFU,
                     (address >> 8U) & 0xFFU, address & 0xFFU, port);
}

Actions Bridge::on_message(std::string_view channel, std::string_view bytes, Sender sender,
                           fabric::Moment now) {
  Actions actions;
  if (channel == presence_channel) {
    if (const auto presence = parse_presence(bytes)) {
      on_presence(*presence, sender, now, actions);
    } else {
      warn_limited("presence", "",
                   fmt::format("a message on {} from {} is not a presence message: {}", channel,
                               sender.to_string(), presence.error()),
                   now.steady, actions);
    }
  } else if (channel.starts_with(reply_prefix)) {
    const std::string_view uuid = channel.substr(reply_prefix.size());
    if (const auto answered = parse_reply(bytes)) {
      on_reply(uuid, *answered, sender, now.steady, actions);
    } else {
      warn_limited("reply", uuid,
                   fmt::format("a message on {} from {} is not a reply: {}",
                               base::text::safe(channel), sender.to_string(), answered.error()),
                   now.steady, actions);
    }
  }
  return actions;
}

Actions Bridge::on_fragment(std::string_view channel, Sender sender, SteadyTime now) {
  Actions actions;
  if (is_ours(channel)) {
    warn_limited(
        "fragment", channel,
        fmt::format("a message on {} from {} is longer than {} bytes; ignored",
                    base::text::safe(channel), sender.to_string(), fabric::lcm::longest_packet),
        now, actions);
  }
  return actions;
}

void Bridge::on_presence(const Presence& presence, Sender sender, fabric::Moment now,
                         Actions& actions) {
  const Key key{presence.announcement.uuid, presence.program};
  Program* const program = welcome(key, presence, sender, now, actions);
  if (program == nullptr) {
    return;
  }
  program->last_message = now.steady;
  keep_registered(*program, presence, now.steady, actions);
  compare_calls(*program, key, presence, now.steady, actions);
}

/// The LCM process that announced its presence; null if the announcement is not accepted.

Bridge::Program* Bridge::welcome(const Key& key, const Presence& presence, Sender sender,
                                 fabric::Moment now, Actions& actions) {
  const auto& [uuid, number] = key;
  if (const auto off = std::chrono::abs(now.wall - presence.at); off > rules_.silence) {
    warn_limited(
        "clock", uuid,
        fmt::format(
            "the time of {} of {} at {} is {} ms {} this host's: the clocks differ, or a log "
            "is played; ignored",
            program_name(number), uuid, sender.to_string(),
            std::chrono::duration_cast<std::chrono::milliseconds>(off).count(),
            presence.at < now.wall ? "before" : "after"),
        now.steady, actions);
    return nullptr;
  }
  const bool is_named = rules_.find(uuid) != nullptr;
  if (!is_named && rules_.any_uuid && !fabric::is_uuid(uuid)) {
    warn_limited("no uuid", "",
                 fmt::format("{} at {} announces '{}', which is not a UUID; it is served only if "
                             "the configuration names it (service {{ uuid }})",
                             program_name(number), sender.to_string(), base::text::safe(uuid)),
                 now.steady, actions);
    return nullptr;
  }
  if (!is_named && !rules_.any_uuid) {
    warn_limited(
        "uuid", uuid,
        fmt::format("{} at {} announces {}, which the configuration does not name; it is not "
                    "served",
                    program_name(number), sender.to_string(), uuid),
        now.steady, actions);
    return nullptr;
  }
  const auto place = programs_.find(key);
  if (place != programs_.end()) {
    if (place->second.sender == sender) {
      return &place->second;
    }
    warn_limited("twice", uuid,
                 fmt::format("{} of {} is at {} and also at {}: two programs have the same number, "
                             "or one has two LCM instances; the second is ignored",
                             program_name(number), uuid, place->second.sender.to_string(),
                             sender.to_string()),
                 now.steady, actions);
    return nullptr;
  }
  // LCM processes that the configuration does not name take no room from those that it names.
  const auto there =
      static_cast<std::size_t>(std::ranges::count_if(programs_, [&](const auto& program) {
        return (rules_.find(program.first.first) != nullptr) == is_named;
      }));
  if (there >= rules_.most_programs) {
    warn_limited("full", is_named ? "named" : "",
                 fmt::format("{} programs are served, the limit; {} of {} at {} is not served",
                             there, program_name(number), uuid, sender.to_string()),
                 now.steady, actions);
    return nullptr;
  }
  return &programs_.emplace(key, Program{.sender = sender}).first->second;
}

void Bridge::keep_registered(Program& program, const Presence& presence, SteadyTime now,
                             Actions& actions) {
  const Key key{presence.announcement.uuid, presence.program};
  const sdk::Announcement wanted = ruled(presence.announcement);
  const bool too_soon = program.registered_at && now - *program.registered_at < register_pause;
  if (program.registration) {
    if (presence.draining && !program.draining) {
      program.draining = true;
      actions.emplace_back(Drain{*program.registration});
    } else if (!program.draining && !program.dismissed && wanted != program.announced &&
               program.calls.empty() && !too_soon) {
      registered_.erase(*program.registration);
      actions.emplace_back(Unregister{*program.registration});
      register_again(program, key, wanted, now, actions);
    }
  } else if (!presence.draining && !program.dismissed && !too_soon &&
             !(program.refused && program.announced == wanted)) {
    program.draining = false;
    register_again(program, key, wanted, now, actions);
  }
  if (program.dismissed && !presence.draining && now - program.asked_to_leave >= settle) {
    program.asked_to_leave = now;
    actions.emplace_back(drain_of(key.first, key.second));
  }
}

Actions Bridge::on_dismissed(Registration number, SteadyTime now) {
  const auto [key, program] = find(number);
  if (program == nullptr || program->dismissed) {
    return {};
  }
  program->dismissed = true;
  program->asked_to_leave = now;
  return {drain_of(key->first, key->second)};
}

Actions Bridge::on_drained(Registration number) {
  const auto [key, program] = find(number);
  if (program == nullptr) {
    return {};
  }
  Actions actions{
      Unregister{number},
      LogLine{Level::info,
              fmt::format("{} of {} has answered all its calls and is not served any more",
                          program_name(key->second), key->first)}};
  program->registration.reset();
  program->calls.clear();
  registered_.erase(number);
  return actions;
}

Actions Bridge::on_refused(Registration number, const std::string& reason, SteadyTime now) {
  Actions actions;
  if (const auto [key, program] = find(number); program != nullptr) {
    warn_limited(
        "refused", key->first,
        fmt::format("{} of {} cannot be served: {}", program_name(key->second), key->first, reason),
        now, actions);
    program->registration.reset();
    program->calls.clear();
    program->refused = true;
    registered_.erase(number);
  }
  return actions;
}

/// Messages that arrived during the standstill are still unread.
void Bridge::forgive_standstill(SteadyTime now) {
  const SteadyTime last = last_time_.value_or(now);
  last_time_ = now;
  if (now - last < stood_still) {
    return;
  }
  for (auto& [key, program] : programs_) {
    program.last_message = std::min(program.last_message + (now - last), now);
  }
}

Actions Bridge::on_time(SteadyTime now) {
  forgive_standstill(now);
  Actions actions;
  for (auto place = programs_.begin(); place != programs_.end();) {
    auto& [key, program] = *place;
    if (now - program.last_message > rules_.silence) {
      lose(key, program, actions);
      place = programs_.erase(place);
      continue;
    }
    for (auto& [call, given] : program.calls) {
      flush_interim(program, given, now, actions);
    }
    ++place;
  }
  for (std::string& line : log_limiter_.due(now)) {
    actions.emplace_back(LogLine{Level::warn, std::move(line)});
  }
  return actions;
}

void Bridge::lose(const Key& key, Program& program, Actions& actions) {
  const bool in_order = program.calls.empty() && (program.draining || program.dismissed);
  actions.emplace_back(LogLine{
      in_order ? Level::info : Level::warn,
      fmt::format("{} of {} at {} is gone: silent for {} ms; {} of its calls go to other instances",
                  program_name(key.second), key.first, program.sender.to_string(),
                  rules_.silence.count(), program.calls.size())});
  if (program.registration) {
    registered_.erase(*program.registration);
    actions.emplace_back(Unregister{*program.registration});
  }
}

void Bridge::register_again(Program& program, const Key& key, const sdk::Announcement& as,
                            SteadyTime now, Actions& actions) {
  const Registration number = ++last_registration_;
  program.registration = number;
  program.registered_at = now;
  program.announced = as;
  program.refused = false;
  registered_.emplace(number, key);
  actions.emplace_back(Register{number, program.announced});
  actions.emplace_back(LogLine{
      Level::info, fmt::format("{} of {} at {} is there: {}", program_name(key.second), key.first,
                               program.sender.to_string(), program.announced.name)});
}

void Bridge::warn_limited(const char* kind, std::string_view about, const std::string& text,
                          SteadyTime now, Actions& actions) {
  // Foreign text in `about` must not create a kind of its own.
  const std::string uuid = fabric::canonical_uuid(about);
  const bool known =
      rules_.find(uuid) != nullptr || std::ranges::any_of(registered_, [&](const auto& registered) {
        return registered.second.first == uuid;
      });
  if (auto line = log_limiter_.admit(kind, known ? uuid : "", text, now)) {
    actions.emplace_back(LogLine{Level::warn, *std::move(line)});
  }
}

sdk::Announcement Bridge::ruled(sdk::Announcement announcement) const {
  if (const ServiceRule* const rule = rules_.find(announcement.uuid)) {
    announcement.channels = rule->channels.empty() ? announcement.channels : rule->channels;
    announcement.delivery = rule->delivery.value_or(announcement.delivery);
    announcement.concurrency = rule->concurrency.value_or(announcement.concurrency);
  }
  return announcement;
}

std::pair<const Bridge::Key*, Bridge::Program*> Bridge::find(Registration number) {
  const auto registered = registered_.find(number);
  if (registered == registered_.end()) {
    return {nullptr, nullptr};
  }
  const auto place = programs_.find(registered->second);
  return {&registered->second, &place->second};
}

}  // namespace millrace::services::lcm
