#include "gateway/channel/answered_requests.hpp"

#include <algorithm>

namespace millrace::gateway::channel {

void AnsweredRequests::add(const fabric::RequestKey& request, SteadyTime now) {
  replace(request);
  places_.emplace(request, oldest_first_.insert(oldest_first_.end(), {request, now}));
  if (!sweep_) {
    sweep_ = now + quiet;
  }
}

void AnsweredRequests::replace(const fabric::RequestKey& request) {
  if (const auto place = places_.find(request); place != places_.end()) {
    oldest_first_.erase(place->second);
    places_.erase(place);
  }
}

std::vector<fabric::RequestKey> AnsweredRequests::take(const fabric::ChannelKey& key) {
  std::vector<fabric::RequestKey> taken;
  for (const auto& [request, since] : oldest_first_) {
    if (request.key == key) {
      taken.push_back(request);
    }
  }
  for (const fabric::RequestKey& request : taken) {
    replace(request);
  }
  return taken;
}

std::vector<fabric::RequestKey> AnsweredRequests::take_all() {
  std::vector<fabric::RequestKey> taken;
  for (const auto& [request, since] : oldest_first_) {
    taken.push_back(request);
  }
  oldest_first_.clear();
  places_.clear();
  sweep_.reset();
  return taken;
}

std::vector<fabric::RequestKey> AnsweredRequests::due(SteadyTime now) {
  std::vector<fabric::RequestKey> taken;
  if (!sweep_ || now < *sweep_) {
    return taken;
  }
  while (!oldest_first_.empty() && oldest_first_.front().second + quiet <= now &&
         taken.size() < at_once) {
    taken.push_back(oldest_first_.front().first);
    places_.erase(taken.back());
    oldest_first_.pop_front();
  }
  sweep_ = oldest_first_.empty()
               ? std::nullopt
               : std::optional(std::max(oldest_first_.front().second + quiet, now + pause));
  return taken;
}

}  // namespace millrace::gateway::channel
