// Each field of each value is set to another value than its default and sent through each view and
// back. A field that no view transfers fails here; a field that is missing in a list does not
// compile.
#include <fstream>
#include <map>
#include <set>
#include <utility>

#include <boost/json/parse.hpp>
#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include "fabric/registry/identity.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/words.hpp"
#include "idl/recording.pb.h"
#include "tests/support/data.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/unit/every_field/filled.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/recording/codec.hpp"

namespace millrace {
namespace {

namespace pb = google::protobuf;
using fabric::observer::Entry;
using fabric::wire::Codec;
using tests::entry_of;
using tests::filled;
using tests::for_each_sample;

/// A member of a struct of the IDL.
struct Member {
  std::string name;
  std::uint32_t bound;
  /// Whether it is not all zeros in a sample.
  bool (*is_set)(const void* sample);
};

template <typename Field>
bool is_set(const Field& field) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&field);
  return std::any_of(bytes, bytes + sizeof field, [](unsigned char byte) { return byte != 0; });
}

const std::multimap<std::string, Member> members{
#define MEMBER(type, name, bound)                                   \
  {#type, {#name, bound, [](const void* sample) {                   \
             return is_set(static_cast<const type*>(sample)->name); \
           }}},
#define ENUMERATOR(type, name)
#include "tests/unit/every_field/idl_members.inc"
#undef MEMBER
#undef ENUMERATOR
};

const std::multimap<std::string, std::string> enumerators{
#define MEMBER(type, name, bound)
#define ENUMERATOR(type, name) {#type, #name},
#include "tests/unit/every_field/idl_members.inc"
#undef MEMBER
#undef ENUMERATOR
};

/// The members of the IDL that some sample has set.
class Reached {
 public:
  template <typename Type>
  void add(const char* type, const Type& sample) {
    const auto [first, last] = members.equal_range(type);
    for (auto member = first; member != last; ++member) {
      if (member->second.is_set(&sample)) {
        reached_.emplace(type, member->second.name);
      }
    }
  }
  template <typename Sequence>
  void add_all(const char* type, const Sequence& samples) {
    for (std::uint32_t i = 0; i < samples._length; ++i) {
      add(type, samples._buffer[i]);
    }
  }
  [[nodiscard]] std::set<std::pair<std::string, std::string>> missing() const {
    std::set<std::pair<std::string, std::string>> missing;
    for (const auto& [type, member] : members) {
      if (!reached_.contains({type, member.name})) {
        missing.emplace(type, member.name);
      }
    }
    return missing;
  }

 private:
  std::set<std::pair<std::string, std::string>> reached_;
};

/// Sends a value with every field set; returns what was received.
template <typename Value, typename Look>
Value sent(const Value& value, const Look& look) {
  const auto sample = Codec<Value>::encode(value);
  if (!sample) {
    ADD_FAILURE() << sample.error();
    return {};
  }
  look(static_cast<const typename Codec<Value>::Sample&>(*sample));
  return Codec<Value>::decode(*sample);
}

TEST(EveryField, TravelsOverTheWireAndEachMemberOfTheIdlIsReached) {
  Reached reached;
  const auto travels = [&]<typename Value>(const char* type, const Value& value) {
    EXPECT_EQ(sent(value, [&](const auto& sample) { reached.add(type, sample); }), value) << type;
  };
  auto request = filled<fabric::Request>();
  request.requester = 0;
  travels("millrace_Request", request);
  travels("millrace_Reply", filled<fabric::Reply>());
  // Only an observer says that a gateway is gone.
  auto channel = filled<fabric::ChannelStatus>();
  channel.gone = false;
  travels("millrace_ChannelStatus", channel);
  auto machine = filled<fabric::MachineStatus>();
  machine.gone = false;
  travels("millrace_MachineStatus", machine);
  travels("millrace_Event", filled<fabric::Event>());
  travels("millrace_Command", filled<fabric::Command>());
  travels("millrace_Outcome", filled<fabric::Outcome>());
  travels("millrace_DataSample", filled<fabric::DataSample>());
  travels("millrace_ProgramEvent", filled<fabric::ProgramEvent>());
  travels("millrace_Alarm", filled<fabric::Alarm>());
  travels("millrace_Heartbeat", filled<fabric::Heartbeat>());
  auto question = filled<fabric::VariableRequest>();
  question.excess.clear();
  travels("millrace_VariableRequest", question);
  travels("millrace_VariableReply", filled<fabric::VariableReply>());

  sent(filled<fabric::Event>(), [&](const millrace_Event& event) {
    reached.add("millrace_CallId", event.call);
    reached.add_all("millrace_MessagePart", event.detail);
    reached.add_all("millrace_Extra", event.extras);
  });
  sent(filled<fabric::Heartbeat>(), [&](const millrace_Heartbeat& heartbeat) {
    reached.add_all("millrace_InstanceLoad", heartbeat.loads);
  });
  sent(filled<fabric::DataSample>(),
       [&](const millrace_DataSample& data) { reached.add_all("millrace_Value", data.values); });
  sent(filled<fabric::VariableReply>(), [&](const millrace_VariableReply& reply) {
    reached.add_all("millrace_VariableResult", reply.results);
  });
  EXPECT_THAT(reached.missing(), testing::IsEmpty());
}

template <typename Value>
void expect_bounds_of(const std::string& type) {
  fabric::for_each_field<Value>([&](const auto& field) {
    const auto [first, last] = members.equal_range(type);
    for (auto member = first; member != last; ++member) {
      if (member->second.name == field.name && member->second.bound != 0 &&
          field.options.most != 0) {
        EXPECT_EQ(field.options.most, member->second.bound) << type << ' ' << field.name;
      }
    }
  });
}

TEST(EveryField, HasTheBoundOfTheIdl) {
  expect_bounds_of<fabric::Request>("millrace_Request");
  expect_bounds_of<fabric::Event>("millrace_Event");
  expect_bounds_of<fabric::MachineStatus>("millrace_MachineStatus");
  expect_bounds_of<fabric::Heartbeat>("millrace_Heartbeat");
  expect_bounds_of<fabric::InstanceLoad>("millrace_InstanceLoad");
}

std::string plain(std::string_view word) {
  std::string text(word);
  for (char& c : text) {
    c = c == '-' || c == ' ' ? '_' : static_cast<char>(std::tolower(c));
  }
  return text;
}

/// Each number of an enumeration has the same name in the IDL, in recordings and in texts.
template <typename Enum>
void expect_order(const char* of_idl, const char* of_recording) {
  const auto* const recorded =
      recording::Request::descriptor()->file()->FindEnumTypeByName(of_recording);
  auto [idl, last] = enumerators.equal_range(of_idl);
  int number = 0;
  for (; !name_of(static_cast<Enum>(number)).starts_with("unknown"); ++number) {
    const std::string word = plain(name_of(static_cast<Enum>(number)));
    ASSERT_LT(number, recorded->value_count()) << of_recording;
    EXPECT_EQ(recorded->value(number)->number(), number);
    EXPECT_THAT(plain(recorded->value(number)->name()), testing::HasSubstr(word));
    if (*of_idl != '\0') {
      ASSERT_NE(idl, last) << of_idl << ' ' << word;
      EXPECT_THAT(plain(idl++->second), testing::HasSubstr(word));
    }
  }
  EXPECT_EQ(recorded->value_count(), number) << of_recording;
  EXPECT_EQ(idl, last) << of_idl;
}

TEST(EveryField, OfAnEnumerationHasOneOrderEverywhere) {
  expect_order<fabric::ReplyKind>("millrace_reply_kind", "ReplyKind");
  expect_order<fabric::ServiceCode>("millrace_service_code", "ServiceCode");
  expect_order<fabric::ChannelState>("millrace_channel_state", "ChannelState");
  expect_order<fabric::JournalState>("millrace_journal_state", "JournalState");
  expect_order<fabric::WatchMode>("millrace_watch_mode", "WatchMode");
  expect_order<fabric::EventKind>("millrace_event_kind", "EventKind");
  expect_order<fabric::CommandKind>("millrace_command_kind", "CommandKind");
  expect_order<fabric::ValueType>("millrace_value_type", "ValueType");
  expect_order<fabric::Quality>("millrace_quality", "Quality");
  expect_order<fabric::ProgramEventKind>("millrace_program_event_kind", "ProgramEventKind");
  expect_order<fabric::AlarmLevel>("millrace_alarm_level", "AlarmLevel");
  expect_order<fabric::Delivery>("", "Delivery");
  expect_order<fabric::observer::Change>("", "InstanceChange");
  EXPECT_EQ(static_cast<int>(fabric::VariableAction::list), millrace_variable_action_list);
}

Entry read_back(const Entry& entry) {
  const auto got = tools::recording::decode(tools::recording::schema_name(entry),
                                            tools::recording::encode(entry), entry.at);
  EXPECT_TRUE(got) << got.error();
  return got.value_or(Entry{});
}

TEST(EveryField, IsRecordedAndReadBack) {
  for_each_sample([](const auto& sample) {
    Entry entry = entry_of(sample);
    EXPECT_EQ(read_back(entry), entry) << kind_of(entry);
    if (text_of(entry) != nullptr) {
      withhold_text(entry);
      EXPECT_EQ(read_back(entry), entry) << kind_of(entry);
    }
  });
}

// Each kind as an earlier version recorded it, full, empty and without its text, with that
// version's JSON. The present version may print more.
TEST(EveryField, OfAnEarlierRecordingIsRead) {
  // Boost 1.81 cannot parse this from a stream with the smaller buffers that it has on Arm
  // (BOOST_JSON_STACK_BUFFER_SIZE).
  std::ifstream file(tests::test_data("recordings/earlier.json"));
  const std::string json{std::istreambuf_iterator<char>(file), {}};
  const boost::json::value shown = boost::json::parse(json);
  std::set<std::string_view> kinds;
  for (const auto& [name, bytes] : tests::read_hex_vectors("recordings/earlier.hex")) {
    const auto entry =
        tools::recording::decode("millrace.recording." + name.substr(0, name.find('.')),
                                 std::string(bytes.begin(), bytes.end()), tests::recorded_at);
    ASSERT_TRUE(entry) << name;
    const boost::json::object now = tools::print::json_of(*entry);
    for (const auto& [key, value] : shown.at(name).as_object()) {
      // An id of zeros is left out.
      if (value != boost::json::string(fabric::InstanceId{}.to_string())) {
        ASSERT_TRUE(now.contains(key)) << name << ' ' << key;
        EXPECT_EQ(tools::print::json_text(now.at(key)), tools::print::json_text(value))
            << name << ' ' << key;
      }
    }
    kinds.insert(kind_of(*entry));
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<fabric::observer::Sample>);
}

void note_fields(const pb::Message& message, std::set<std::string>& set) {
  std::vector<const pb::FieldDescriptor*> fields;
  const pb::Reflection& reflection = *message.GetReflection();
  reflection.ListFields(message, &fields);
  EXPECT_TRUE(reflection.GetUnknownFields(message).empty()) << message.GetTypeName();
  for (const pb::FieldDescriptor* field : fields) {
    set.insert(field->full_name());
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      continue;
    }
    if (!field->is_repeated()) {
      note_fields(reflection.GetMessage(message, field), set);
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      note_fields(reflection.GetRepeatedMessage(message, field, i), set);
    }
  }
}

TEST(EveryField, OfTheRecordingSchemaIsReached) {
  const pb::FileDescriptor& file = *recording::Request::descriptor()->file();
  std::set<std::string> set;
  const auto note = [&](const Entry& entry) {
    const auto* const type =
        file.pool()->FindMessageTypeByName(tools::recording::schema_name(entry));
    const std::unique_ptr<pb::Message> message(
        pb::MessageFactory::generated_factory()->GetPrototype(type)->New());
    ASSERT_TRUE(message->ParseFromString(tools::recording::encode(entry)));
    note_fields(*message, set);
    // Protobuf's own bytes, as written by earlier versions, decode to the same.
    EXPECT_EQ(tools::recording::decode(type->full_name(), message->SerializeAsString(), entry.at),
              entry);
  };
  for_each_sample([&](auto sample) {
    Entry entry = entry_of(sample);
    note(entry);
    withhold_text(entry);
    note(entry);
    // A UUID that a program may write: not UTF-8.
    const std::string uuid =
        "pr\xFC"
        "fen";
    if constexpr (requires { sample.uuid; }) {
      sample.uuid = uuid;
    } else if constexpr (requires { sample.identity; }) {
      sample.identity.uuid = uuid;
    }
    entry = entry_of(sample);
    entry.uuid = entry.uuid.empty() ? "" : uuid;
    note(entry);
  });
  for (int i = 0; i < file.message_type_count(); ++i) {
    for (int j = 0; j < file.message_type(i)->field_count(); ++j) {
      const std::string& name = file.message_type(i)->field(j)->full_name();
      EXPECT_TRUE(set.contains(name)) << name;
    }
  }
}

/// Calls `use` while one field after the other has its default.
template <typename Value, typename Use>
void for_each_default(Value& value, const Use& use) {
  fabric::for_each_field<Value>([&](const auto& field) {
    auto& member = field.get(value);
    using Its = std::remove_cvref_t<decltype(member)>;
    if constexpr (fabric::HasFields<Its>) {
      for_each_default(member, use);
    } else if (field.options.observed) {
      Its kept = std::exchange(member, Its{});
      use(field.name);
      member = std::move(kept);
    }
  });
}

std::string json(const Entry& entry) {
  return tools::print::json_text(tools::print::json_of(entry));
}

TEST(EveryField, IsInJsonAndCsv) {
  for_each_sample([](auto sample) {
    const Entry whole = entry_of(sample);
    const std::string kind(kind_of(whole));
    const tools::print::Csv csv({kind});
    for_each_default(sample, [&](std::string_view field) {
      const Entry less = entry_of(sample);
      EXPECT_NE(json(less), json(whole)) << kind << ' ' << field;
      EXPECT_NE(csv.row(less), csv.row(whole)) << kind << ' ' << field;
    });
    for (const auto& each : tools::print::json_of(whole)) {
      EXPECT_THAT(csv.header(), testing::ContainsRegex("(^|,)" + std::string(each.key()) + "[,\r]"))
          << kind;
    }
  });
}

TEST(EveryField, OfAValueIsInItsJson) {
  for (fabric::Value value : filled<fabric::DataSample>().values) {
    const Entry whole = entry_of(fabric::DataSample{.values = {value}});
    for_each_default(value, [&](std::string_view field) {
      EXPECT_NE(json(entry_of(fabric::DataSample{.values = {value}})), json(whole)) << field;
    });
  }
}

TEST(EveryField, OfAnIdentityIsAnnounced) {
  auto sut = filled<fabric::InstanceIdentity>();
  sut.certificate.clear();
  EXPECT_EQ(fabric::registry::parse_identity(fabric::registry::format_identity(sut)), sut);
}

}  // namespace
}  // namespace millrace
