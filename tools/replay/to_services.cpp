#include "tools/replay/to_services.hpp"

namespace millrace::tools::replay {

std::set<std::pair<std::string, fabric::ChannelKey>> needs_of(const Plan& plan) {
  std::set<std::pair<std::string, fabric::ChannelKey>> needs;
  for (const PlannedCall& call : plan.calls) {
    needs.emplace(call.uuid, call.channel);
  }
  return needs;
}

ToServices::ToServices(fabric::dds::Participant& participant,
                       const boost::asio::any_io_executor& executor, const caller::Slot& slot,
                       const Plan& plan, const ReplayChannels& channels, ReplayListener& listener)
    : executor_(executor),
      plan_(plan),
      channels_(channels),
      listener_(listener),
      caller_(participant, executor, *this, slot) {}

std::vector<std::string> ToServices::missing() const {
  std::set<std::string> reasons;
  for (const auto& [uuid, channel] : needs_of(plan_)) {
    if (const auto why = caller_.why_unserved(uuid, channels_.at(channel).as)) {
      reasons.insert(*why);
    }
  }
  return {reasons.begin(), reasons.end()};
}

void ToServices::play(const PlayOptions& options) {
  player_.emplace(executor_, plan_, options, *this);
  player_->start();
}

void ToServices::issue(std::size_t call) {
  const PlannedCall& planned = plan_.calls[call];
  const ReplayChannel& channel = channels_.at(planned.channel);
  const auto id = caller_.call({.key = channel.key,
                                .as = channel.as,
                                .uuid = planned.uuid,
                                .text = planned.text,
                                .state = planned.state,
                                .replayed = true});
  if (!id) {
    player_->ended(call, std::nullopt, id.error());
    return;
  }
  open_.insert_or_assign(*id, call);
  ids_.insert_or_assign(call, *id);
}

void ToServices::withdraw(std::size_t call, const fabric::Message& reason) {
  if (const auto id = ids_.find(call); id != ids_.end()) {
    caller_.give_up(id->second, reason);
  }
}

void ToServices::on_ended(const caller::Ended& ended) {
  const auto found = open_.find(ended.call);
  if (found == open_.end()) {
    return;
  }
  const std::size_t call = found->second;
  open_.erase(found);
  ids_.erase(call);
  std::optional<Answer> answer;
  if (ended.reply) {
    answer = Answer{ended.reply->text, ended.reply->state, std::nullopt};
  }
  player_->ended(call, std::move(answer), ended.reason);
}

}  // namespace millrace::tools::replay
