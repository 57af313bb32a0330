#include "fabric/wire/notice_codec.hpp"

#include "fabric/wire/sample_fields.hpp"

namespace millrace::fabric::wire {

static_assert(convert<int>(NoticeLevel::problem) == millrace_notice_problem);

const Topic notice_topic{"millrace/notice", &millrace_Notice_desc, true, 1, false, 1'024};

Encoded<millrace_Notice> Codec<Notice>::encode(const Notice& value) {
  Filler<millrace_Notice> filler;
  put(filler.sample.responder, value.key.responder);
  filler.string(filler.sample.kind, value.key.kind, "kind of the notice");
  filler.string(filler.sample.subject, value.key.subject, "subject of the notice");
  filler.sample.level = convert<millrace_NoticeLevel>(value.level);
  filler.string(filler.sample.text, value.text, "text of the notice");
  filler.string(filler.sample.advice, value.advice, "advice of the notice");
  filler.sample.since = put(value.since);
  filler.string(filler.sample.program, value.program, "name of the program");
  filler.string(filler.sample.host, value.host, "name of the host");
  filler.sample.pid = value.pid;
  return filler.result();
}

Notice Codec<Notice>::decode(const millrace_Notice& sample) {
  return {
      .key = {get(sample.responder), sample.kind, sample.subject},
      .level = convert<NoticeLevel>(sample.level),
      .text = sample.text,
      .advice = sample.advice,
      .since = get(sample.since),
      .program = sample.program,
      .host = sample.host,
      .pid = sample.pid,
  };
}

}  // namespace millrace::fabric::wire
