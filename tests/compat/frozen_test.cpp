// Today's programs read what 1.0 has written (1.0/README.md). With MILLRACE_FREEZE=FOLDER each test
// writes its files there instead, as they were made once.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value_from.hpp>
#include <dds/ddsi/ddsi_serdata.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/data_endpoint.hpp"
#include "fabric/wire/codec.hpp"
#include "gateway/journal/format.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/data.hpp"
#include "tests/support/http_client.hpp"
#include "tests/unit/every_field/filled.hpp"
#include "tools/print/json.hpp"

namespace millrace::tests::compat {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;
using integration::Chain;
using integration::Flags;

const fs::path frozen = MILLRACE_FROZEN;
const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string archiver = "326de49a-633b-4cea-a9b8-1924d7f926a7";
const std::string mail = "b536e110-ca9e-4198-bddb-64331366bedb";

/// Where the files are made; none: they are read.
std::optional<fs::path> making() {
  const char* const folder = std::getenv("MILLRACE_FREEZE");
  return folder == nullptr ? std::nullopt : std::optional<fs::path>(folder);
}

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  EXPECT_TRUE(in) << file << " cannot be read";
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The frozen content of the file; `text` when it is made.
std::string kept(const std::string& file, const std::string& text) {
  if (const auto folder = making()) {
    fs::create_directories((*folder / file).parent_path());
    std::ofstream(*folder / file, std::ios::binary) << text;
    return text;
  }
  return content(frozen / file);
}

/// A folder of 1.0 as its programs may change it. `make` fills it when it is made.
fs::path copied(const std::string& folder, const fs::path& into,
                const std::function<void(const fs::path&)>& make) {
  const fs::path copy = into / folder;
  if (const auto made = making()) {
    fs::create_directories(copy);
    make(copy);
    fs::create_directories(*made);
    fs::remove_all(*made / folder);
    fs::copy(copy, *made / folder, fs::copy_options::recursive);
  } else {
    fs::copy(frozen / folder, copy, fs::copy_options::recursive);
  }
  return copy;
}

/// What is wrong with `now`; nothing if it has all that `before` has. Objects may have further
/// members.
std::string missing(const json::value& before, const json::value& now, const std::string& at) {
  if (before.is_object() && now.is_object()) {
    for (const auto& [name, value] : before.as_object()) {
      const auto* const there = now.as_object().if_contains(name);
      const std::string place = at + "." + std::string(name);
      const std::string wrong =
          there == nullptr ? place + " is missing" : missing(value, *there, place);
      if (!wrong.empty()) {
        return wrong;
      }
    }
    return {};
  }
  if (before.is_array() && now.is_array()) {
    if (before.as_array().size() != now.as_array().size()) {
      return at + " has another number of elements";
    }
    for (std::size_t i = 0; i < before.as_array().size(); ++i) {
      const std::string wrong =
          missing(before.as_array()[i], now.as_array()[i], at + "[" + std::to_string(i) + "]");
      if (!wrong.empty()) {
        return wrong;
      }
    }
    return {};
  }
  return before == now ? std::string()
                       : at + " was " + json::serialize(before) + ", is " + json::serialize(now);
}

/// The same of lines of JSON.
void expect_lines(const std::string& before, const std::string& now) {
  std::istringstream lines(before);
  std::istringstream lines_now(now);
  std::size_t number = 0;
  std::string line_now;
  for (std::string line; std::getline(lines, line); ++number) {
    ASSERT_TRUE(std::getline(lines_now, line_now)) << "line " << number << " is missing: " << line;
    EXPECT_EQ(missing(json::parse(line), json::parse(line_now), "line " + std::to_string(number)),
              "");
  }
  EXPECT_GT(number, 0U);
  EXPECT_FALSE(std::getline(lines_now, line_now)) << line_now;
}

/// The same of the members alone, whatever their values are: of lists the first element counts.
/// Null: not known at that time.
std::string missing_members(const json::value& before, const json::value& now,
                            const std::string& at) {
  if (before.is_object() && now.is_object()) {
    for (const auto& [name, value] : before.as_object()) {
      const auto* const there = now.as_object().if_contains(name);
      const std::string place = at + "." + std::string(name);
      const std::string wrong =
          there == nullptr ? place + " is missing" : missing_members(value, *there, place);
      if (!wrong.empty()) {
        return wrong;
      }
    }
    return {};
  }
  if (before.is_array() && now.is_array()) {
    return before.as_array().empty() || now.as_array().empty()
               ? std::string()
               : missing_members(before.as_array()[0], now.as_array()[0], at + "[0]");
  }
  const bool is_same = before.kind() == now.kind() || before.is_null() || now.is_null() ||
                       (before.is_number() && now.is_number());
  return is_same ? std::string()
                 : at + " was " + json::serialize(before) + ", is " + json::serialize(now);
}

/// Bytes of a sample as Cyclone writes them, with their header, and back.
template <typename Value>
class Bytes {
 public:
  using Codec = fabric::wire::Codec<Value>;
  using Sample = typename Codec::Sample;

  explicit Bytes(const fabric::dds::Participant& participant)
      : topic_(checked(dds_create_topic(participant.handle(), Codec::topic().type, "frozen",
                                        nullptr, nullptr))) {
    // A serialised sample names its type, which nothing else gives.
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
    const dds_entity_t reader =
        checked(dds_create_reader(participant.handle(), topic_, qos, nullptr));
    const dds_entity_t writer =
        checked(dds_create_writer(participant.handle(), topic_, qos, nullptr));
    dds_delete_qos(qos);
    const Sample nothing{};
    checked(dds_write(writer, &nothing));
    dds_sample_info_t info{};
    await("its own sample",
          [&] { return dds_takecdr(reader, &any_, 1, &info, DDS_ANY_STATE) == 1; });
  }
  ~Bytes() {
    ddsi_serdata_unref(any_);
    dds_delete(topic_);
  }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;

  std::string of(const Value& value) const {
    const auto sample = Codec::encode(value);
    EXPECT_TRUE(sample) << sample.error();
    const Sample& plain = *sample;
    ddsi_serdata* const data = ddsi_serdata_from_sample(any_->type, SDK_DATA, &plain);
    std::string bytes(ddsi_serdata_size(data), '\0');
    ddsi_serdata_to_ser(data, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(data);
    return bytes;
  }
  Value in(std::string bytes) const {
    const ddsrt_iovec_t all{bytes.data(), bytes.size()};
    ddsi_serdata* const data =
        ddsi_serdata_from_ser_iov(any_->type, SDK_DATA, 1, &all, bytes.size());
    EXPECT_NE(data, nullptr) << "these bytes are no sample of today's type";
    Sample sample{};
    Value value;
    if (data != nullptr) {
      EXPECT_TRUE(ddsi_serdata_to_sample(data, &sample, nullptr, nullptr));
      value = Codec::decode(sample);
      dds_sample_free(&sample, Codec::topic().type, DDS_FREE_CONTENTS);
      ddsi_serdata_unref(data);
    }
    return value;
  }

 private:
  static dds_entity_t checked(dds_entity_t result) {
    if (result < 0) {
      throw std::runtime_error(dds_strretcode(result));
    }
    return result;
  }
  dds_entity_t topic_;
  ddsi_serdata* any_ = nullptr;
};

template <typename Value>
json::object json_of(const Value& value) {
  json::object out;
  tools::print::put_fields(out, value);
  return out;
}
/// No program shows the next three as JSON.
json::object json_of(const fabric::Heartbeat& value) {
  json::array loads;
  for (const fabric::InstanceLoad& load : value.loads) {
    json::object out;
    tools::print::put_fields(out, load.status);
    out["calls"] = load.calls.at(0).to_string();
    loads.push_back(std::move(out));
  }
  return {{"process", value.process.to_string()},
          {"at", value.at.time_since_epoch().count()},
          {"loads", std::move(loads)},
          {"extra", value.extras.at(0).name}};
}
json::object json_of(const fabric::VariableReply& value) {
  json::array results;
  for (const fabric::VariableResult& result : value.results) {
    json::object out;
    tools::print::put_fields(out, result.value);
    out["error"] = result.error;
    out["writable"] = result.writable;
    out["size"] = result.size;
    out["dimensions"] = json::value_from(result.dimensions);
    results.push_back(std::move(out));
  }
  json::object before;
  tools::print::put_fields(before, value.before.at(0));
  json::object out{{"token", value.token.to_string()},
                   {"done", value.done},
                   {"results", std::move(results)},
                   {"before", std::move(before)},
                   {"total", value.total},
                   {"at", value.at.time_since_epoch().count()},
                   {"extra", value.extras.at(0).name}};
  tools::print::put_message(out, "reason", value.reason);
  return out;
}
json::object json_of(const fabric::VariableRequest& value) {
  return {{"requester", value.requester.to_string()},
          {"token", value.token.to_string()},
          {"machine", value.key.machine},
          {"channel", value.key.channel},
          {"action", static_cast<int>(value.action)},
          {"names", json::value_from(value.names)},
          {"values", json::value_from(value.values)},
          {"first", value.first},
          {"patience_ns", value.patience.count()},
          {"age_ns", value.age.count()},
          {"issuer", value.issuer},
          {"at", value.at.time_since_epoch().count()},
          {"extra", value.extras.at(0).name}};
}

template <typename Value>
void expect_sample(const char* name, Value value) {
  SCOPED_TRACE(name);
  const Domain domain;
  const fabric::dds::Participant participant({.domain = domain.number()});
  const Bytes<Value> sut(participant);
  const std::string file = std::string("samples/") + name;
  const std::string bytes = kept(file + ".cdr", making() ? sut.of(value) : std::string());
  value = sut.in(bytes);
  const std::string text = tools::print::json_text(json_of(value)) + "\n";
  EXPECT_EQ(missing(json::parse(kept(file + ".json", text)), json::parse(text), name), "");
  EXPECT_EQ(sut.of(value), bytes);
}

TEST(Frozen, SamplesOfEachTopicAreReadAndWrittenByteForByte) {
  expect_sample("Request", filled<fabric::Request>());
  expect_sample("Reply", filled<fabric::Reply>());
  expect_sample("Heartbeat", filled<fabric::Heartbeat>());
  auto channel = filled<fabric::ChannelStatus>();
  channel.gone = false;
  expect_sample("ChannelStatus", channel);
  auto machine = filled<fabric::MachineStatus>();
  machine.gone = false;
  expect_sample("MachineStatus", machine);
  expect_sample("Event", filled<fabric::Event>());
  expect_sample("Command", filled<fabric::Command>());
  expect_sample("Outcome", filled<fabric::Outcome>());
  expect_sample("DataSample", filled<fabric::DataSample>());
  expect_sample("ProgramEvent", filled<fabric::ProgramEvent>());
  expect_sample("Alarm", filled<fabric::Alarm>());
  auto request = filled<fabric::VariableRequest>();
  request.excess.clear();
  expect_sample("VariableRequest", request);
  expect_sample("VariableReply", filled<fabric::VariableReply>());
}

/// One entry of each kind, with every member.
std::vector<gateway::JournalEntry> journal_of_1_0() {
  using namespace gateway;
  const fabric::CallId call{0xabc, 7};
  const fabric::ChannelKey key{"cnc", 2};
  const fabric::ChannelKey queue{"cnc.alarms", 1};
  const fabric::Time at(std::chrono::seconds(1'800'000'000));
  fabric::InstanceId instance;
  instance.bytes.fill(7);
  fabric::Message reason("no service has the UUID 560a");
  reason.code = "unknown_uuid";
  reason.arguments = {fabric::Message("560a")};
  return {NumbersEntry{0xabc, 4096},
          DispatchedEntry{.call = call,
                          .key = key,
                          .request = {square_root, "2", 5},
                          .seen = at,
                          .delivery = fabric::Delivery::at_most_once,
                          .attempt = 3,
                          .instance = instance,
                          .completion_signal = fabric::CompletionSignal::response},
          InterimEntry{call, 6},
          AnsweredEntry{call, {instance, 3, "1.414214", 9}},
          ClearingEntry{call},
          EndedEntry{call},
          MessageEntry{queue, 12, 3, "tool 7", at},
          LastGetEntry{queue, 3, 12},
          MessageEndedEntry{queue, 12},
          BlockedEntry{.key = key,
                       .state = fabric::ChannelState::unserved,
                       .call = call,
                       .uuid = square_root,
                       .since = at,
                       .reason = reason}};
}

TEST(Frozen, JournalIsReadByTheGateway) {
  const std::string bytes =
      kept("journal/calls.journal", gateway::journal::encode_file(journal_of_1_0()));
  const gateway::journal::Contents contents = gateway::journal::decode(bytes);
  EXPECT_EQ(contents.damage, "");
  EXPECT_EQ(contents.entries, journal_of_1_0());

  Chain chain;
  const fs::path folder = chain.folder() / "journal";
  fs::create_directory(folder);
  std::ofstream(folder / "calls.journal", std::ios::binary) << bytes;
  const Process cnc = chain.cnc();
  Process sut = chain.gateway({"--journal", folder.string()});
  sut.await_error("link up");
  EXPECT_EQ(sut.error_output().find("warning journal"), std::string::npos) << sut.error_output();
}

/// Programs with a fabric of their own, and what they show.
class FrozenFiles : public testing::Test {
 protected:
  static std::string output(Process process) {
    EXPECT_EQ(process.wait(), 0) << process.error_output();
    return process.output();
  }
  [[nodiscard]] std::string millrace(const Flags& command) const {
    return output(chain.millrace(command));
  }
  Chain chain;
};

TEST_F(FrozenFiles, OfAnArchiveAreShownByTheArchiver) {
  const fs::path folder = copied("archive", chain.folder(), [&](const fs::path& empty) {
    const fs::path config = chain.folder() / "archiver.textproto";
    std::ofstream(config) << "folder: '" << empty.string() << "'\n";
    Caller caller(chain.domain());
    Process service({binary("millrace-archiver"), "--config", config.string(), "--domain",
                     std::to_string(chain.domain())});
    service.await("^ready: ");
    ASSERT_TRUE(caller.await_instance(archiver));
    EXPECT_EQ(caller.call(archiver, "PUT part=WELLE7 d=\"12.345 mm\"").text, "OK 1");
    const auto rows = [&](const char* kind) {
      caller.attend();
      return output(Process({binary("millrace-archiver"), "export", "--folder", empty.string(),
                             "--kind", kind, "--format", "jsonl"}));
    };
    auto channel = filled<fabric::ChannelStatus>();
    channel.gone = false;
    caller.publish(channel);
    auto event = filled<fabric::Event>();
    caller.publish(event);
    fabric::dds::Participant there({.domain = chain.domain()});
    fabric::endpoints::DataEndpoint machine(there);
    ASSERT_TRUE(machine.publish(filled<fabric::DataSample>()));
    ASSERT_TRUE(machine.publish(filled<fabric::ProgramEvent>()));
    for (const char* kind : {"event", "channel", "sample", "program"}) {
      await(std::string("a row of ") + kind, [&] { return !rows(kind).empty(); });
    }
    service.terminate();
    EXPECT_EQ(service.wait(), 0) << service.error_output();
  });
  for (const std::string kind : {"put", "event", "channel", "sample", "program"}) {
    const std::string rows =
        output(Process({binary("millrace-archiver"), "export", "--folder", folder.string(),
                        "--kind", kind, "--format", "jsonl"}));
    expect_lines(kept("answers/archive_" + kind + ".jsonl", rows), rows);
  }
}

TEST_F(FrozenFiles, OfASpoolAreContinuedByTheMailService) {
  const fs::path config = chain.folder() / "mail.textproto";
  const auto start = [&](const fs::path& spool) {
    // No server listens there.
    std::ofstream(config) << "server { host: 'localhost' port: 9 starttls: OFF }\nspool: '"
                          << spool.string() << "'\n"
                          << content(test_data("mail/plant.mail.textproto"));
    Process service({binary("millrace-mail"), "--config", config.string(), "--domain",
                     std::to_string(chain.domain())});
    service.await("^ready: ");
    return service;
  };
  Caller caller(chain.domain());
  const fs::path spool = copied("spool", chain.folder(), [&](const fs::path& empty) {
    Process service = start(empty);
    ASSERT_TRUE(caller.await_instance(mail));
    EXPECT_EQ(caller.call(mail, "done program=WELLE7 parts=12").state, 2U);
    service.terminate();
    EXPECT_EQ(service.wait(), 0) << service.error_output();
  });
  Process sut = start(spool);
  sut.await_error("the spool has 1 mails that wait and knows 1 calls");
}

TEST_F(FrozenFiles, OfARecordingAreShownByTheCommands) {
  const std::string file = (chain.folder() / "run.mcap").string();
  if (making()) {
    Process recorder = chain.millrace({"record", "-o", file});
    recorder.await("^ready: ");
    const Process service = chain.square_root();
    Process cnc =
        chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
    const Process gateway = chain.gateway();
    cnc.await("response = 1.732051");
    EXPECT_EQ(cnc.wait(), 0);
    Caller caller(chain.domain());
    fabric::dds::Participant there({.domain = chain.domain()});
    fabric::endpoints::DataEndpoint machine(there);
    ASSERT_TRUE(machine.publish(filled<fabric::DataSample>()));
    ASSERT_TRUE(machine.publish(filled<fabric::ProgramEvent>()));
    EXPECT_EQ(chain.millrace({"services", "--ping"}).wait(), 0);
    recorder.terminate();
    ASSERT_EQ(recorder.wait(), 0) << recorder.error_output();
    kept("recording/run.mcap", content(file));
  } else {
    fs::copy(frozen / "recording/run.mcap", file);
  }
  const std::string entries = millrace({"recording", "cat", "--json", file});
  expect_lines(kept("answers/recording_cat.jsonl", entries), entries);
  const std::string calls = millrace({"recording", "calls", "--json", file});
  expect_lines(kept("answers/recording_calls.jsonl", calls), calls);
  const std::string info = millrace({"recording", "info", "--json", file});
  expect_lines(kept("answers/recording_info.jsonl", info), info);
}

TEST_F(FrozenFiles, OfATrustFolderAreShownByTheCommands) {
  const fs::path folder = copied("trust", chain.folder(), [&](const fs::path& empty) {
    fs::remove(empty);
    const auto trust = [&](Flags command) {
      command.insert(command.begin(), {binary("millrace"), "trust"});
      output(Process(command));
    };
    const std::string pki = empty.string();
    trust({"init", pki, "--days", "36500"});
    trust({"issue", pki, "gateway", "--role", "gateway", "--machine", "cnc", "--days", "36500"});
    trust({"issue", pki, "service", "--role", "service", "--uuid", square_root, "--days", "36500"});
    trust({"issue", pki, "office", "--role", "operator", "--role", "observer", "--days", "36500"});
  });
  // A repository keeps no permissions, and keys have theirs.
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    fs::permissions(entry.path(), entry.is_directory() ? fs::perms(0700) : fs::perms(0600));
  }
  const std::string pki = folder.string();
  const std::string list = output(Process({binary("millrace"), "trust", "list", pki, "--json"}));
  EXPECT_EQ(missing_members(json::parse(kept("answers/trust_list.json", list)), json::parse(list),
                            "list"),
            "");
  const std::string profile = (chain.folder() / "fabric.textproto").string();
  std::ofstream(profile) << "trust { folder: '" << (folder / "service").string()
                         << "' protection: SIGN }\n";
  Process sut({binary("millrace-square-root"), "--fabric-config", profile, "--domain",
               std::to_string(chain.domain())});
  sut.await("^ready: ");
}

TEST_F(FrozenFiles, OfEachConfigurationAreChecked) {
  const fs::path folder = copied("configuration", chain.folder(), [](const fs::path& empty) {
    fs::copy(test_data("config/good"), empty,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    // Rules still change.
    fs::remove(empty / "rules.mail.textproto");
  });
  std::size_t checked = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    std::string program = name.substr(0, name.rfind('.'));
    program = program.substr(program.rfind('.') + 1);
    std::ranges::replace(program, '_', '-');
    // `--check` of the virtual CNC is for NC programs, and the fabric's profile has none.
    if (program == "cnc" || program == "fabric") {
      continue;
    }
    Process sut({binary("millrace-" + program), "--check", entry.path().string()});
    EXPECT_EQ(sut.wait(), 0) << name << ": " << sut.error_output();
    ++checked;
  }
  EXPECT_GE(checked, 14U);
}

TEST_F(FrozenFiles, OfAnswersNameTheMembersThatTheyHaveToday) {
  Process web = chain.millrace({"web", "--listen", "127.0.0.1:0"});
  const auto port = static_cast<std::uint16_t>(
      std::stoi(web.await("^ready: .* at http://127\\.0\\.0\\.1:(\\d+)/").at(1)));
  const Process service = chain.square_root();
  const Process cnc = chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  const Process gateway = chain.gateway();
  const auto get = [&](const std::string& target) { return HttpClient(port).get(target).body; };
  await("the end of a call", [&] {
    return json::parse(get("/api/calls")).at("calls").as_array().size() == 1 &&
           get("/api/channels").find(R"("channel":1,"channel_state":"idle")") != std::string::npos;
  });
  const auto expect = [](const std::string& file, const std::string& now) {
    json::value before = json::parse(kept("answers/" + file + ".json", now));
    if (before.is_object()) {
      before.as_object().erase("events");  // Their members depend on their kinds.
    }
    EXPECT_EQ(missing_members(before, json::parse(now), file), "");
  };
  for (const std::string what : {"about", "snapshot", "machines", "channels", "services",
                                 "concerns", "alarms", "calls", "doctor"}) {
    expect("api_" + what, get("/api/" + what));
  }
  for (const Flags& command : std::vector<Flags>{
           {"machines"}, {"channels"}, {"services"}, {"services", "-i"}, {"status"}, {"doctor"}}) {
    Flags with_json = command;
    with_json.emplace_back("--json");
    expect(command.front() + (command.size() > 1 ? "_instances" : ""), millrace(with_json));
  }
  expect("call", millrace({"call", square_root, "4", "--json"}));
}

}  // namespace
}  // namespace millrace::tests::compat
