#include "gateway/shell/ads_service_access.hpp"

#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "base/messages/catalogue.hpp"
#include "base/program/barrier.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;
using cnc::ads::ErrorCode;

bool link_gone(ErrorCode code) {
  return code == ErrorCode::link_lost || code == ErrorCode::link_down ||
         code == ErrorCode::cancelled;
}

WriteOutcome outcome_of(ErrorCode code) {
  return cnc::ads::leaves_outcome_unknown(code) ? WriteOutcome::unknown : WriteOutcome::refused;
}

ServiceSnapshot snapshot_of(ReadSet set, std::vector<cnc::variables::ServiceValue> values) {
  ServiceSnapshot snapshot;
  snapshot.set = set;
  const auto variables = variables_of(set);
  for (std::size_t i = 0; i < variables.size(); ++i) {
    switch (variables[i]) {
      case Variable::uuid:
        snapshot.uuid = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request:
        snapshot.request = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request_state:
        snapshot.request_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response_state:
        snapshot.response_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response:
        snapshot.response = std::get<std::string>(std::move(values[i]));
        break;
    }
  }
  return snapshot;
}

/// Variables in one request: a controller processes the items of a sum one after the other, and
/// other requests wait.
constexpr std::size_t most_variables = 64;
/// Requests with reads on the wire; further reads wait and share the next one.
constexpr std::size_t most_requests = 4;

}  // namespace

AdsServiceAccess::AdsServiceAccess(asio::any_io_executor executor, std::string machine,
                                   cnc::ads::Client& client, machines::ControllerEvents& events)
    : executor_(std::move(executor)),
      machine_(std::move(machine)),
      client_(client),
      events_(events),
      reads_(client) {}

void AdsServiceAccess::begin(const cnc::variables::Location& location) {
  location_ = location;
  reads_.forget(location_);
}

void AdsServiceAccess::read(const Link& link, std::uint16_t channel, ReadSet set) {
  due_.emplace_back(channel, set);
  if (due_.size() == 1) {
    asio::post(executor_, [this, link] { send_reads(link); });
  }
}

void AdsServiceAccess::send_reads(const Link& link) {
  // Without sums each read takes requests of its own.
  const bool sums = reads_.sums();
  while (!stopped_ && !due_.empty() && (requests_ < most_requests || !sums)) {
    Reads together;
    std::size_t variables = 0;
    while (!due_.empty() && (together.empty() || sums) &&
           variables + variables_of(due_.front().second).size() <= most_variables) {
      variables += variables_of(due_.front().second).size();
      together.push_back(due_.front());
      due_.pop_front();
    }
    ++requests_;
    asio::co_spawn(executor_, read_together(link, std::move(together)),
                   base::program::rethrow_from_loop);
  }
}

asio::awaitable<void> AdsServiceAccess::read_together(Link link, Reads reads) {
  std::vector<cnc::variables::ServiceReads::Wanted> wanted;
  for (const auto& [channel, set] : reads) {
    wanted.push_back({channel, variables_of(set)});
  }
  auto found = co_await reads_.read(std::move(wanted));
  --requests_;
  for (std::size_t i = 0; i < reads.size() && !stopped_; ++i) {
    const auto& [channel, set] = reads[i];
    if (found[i]) {
      events_.on_read({machine_, channel}, snapshot_of(set, std::move(*found[i])));
    } else {
      read_failed(channel, found[i].error());
    }
  }
  send_reads(link);
}

void AdsServiceAccess::read_failed(std::uint16_t channel, ErrorCode code) {
  events_.on_read_failed({machine_, channel},
                         link_gone(code)
                             ? fabric::Message()
                             : base::messages::read_refused(channel, cnc::ads::describe(code)));
}

void AdsServiceAccess::write(const Link& link, std::uint16_t channel, Variable variable,
                             const Value& value) {
  asio::co_spawn(executor_, write_one(link, channel, variable, value),
                 base::program::rethrow_from_loop);
}

asio::awaitable<void> AdsServiceAccess::write_one([[maybe_unused]] Link link, std::uint16_t channel,
                                                  Variable variable, Value value) {
  cnc::variables::ServiceInterface service(client_, channel, location_);
  const auto written = co_await service.write(variable, std::move(value));
  if (!written) {
    co_await asio::post(executor_, asio::use_awaitable);
  }
  if (stopped_) {
    co_return;
  }
  const fabric::ChannelKey key{machine_, channel};
  if (written) {
    events_.on_write(key, WriteOutcome::written, "");
  } else {
    events_.on_write(key, outcome_of(written.error()),
                     base::messages::write_refused(name_of(variable), channel,
                                                   cnc::ads::describe(written.error())));
  }
}

}  // namespace millrace::gateway::shell
