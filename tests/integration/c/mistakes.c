/* Uses of the C interface that fail, each with its code and its text: a line for each. For tests.
 */
#include <millrace.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static void show(const char* what, millrace_code code) {
  printf("%s: %d %s\n", what, code, code == MILLRACE_OK ? "" : millrace_error());
  fflush(stdout);
}

static void write_log(int32_t level, const char* text, void* context) {
  printf("log %s %d: %s\n", (const char*)context, level, text);
  fflush(stdout);
}

static void join(const char* what, millrace_participant_options options) {
  millrace_participant* participant;
  options.size = sizeof options;
  show(what, millrace_join(&options, &participant));
}

static millrace_code serve(millrace_participant* participant, millrace_service_options options) {
  millrace_service* service = NULL;
  millrace_code code;
  options.size = sizeof options;
  code = millrace_serve(participant, &options, &service);
  millrace_service_free(service);
  return code;
}

static void never(millrace_call* call, void* context) {
  (void)call;
  (void)context;
}

/* What a program has that was compiled with a later header. */
struct later_options {
  millrace_service_options known;
  uint64_t later;
};

int main(void) {
  millrace_participant* participant;
  millrace_service* service;
  millrace_call* call;
  millrace_request* request;
  millrace_participant_options options = {.size = sizeof options};
  struct later_options later;
  pid_t child;

  show("no place", millrace_join(NULL, NULL));
  join("domain", (millrace_participant_options){.use_domain = 1, .domain = 500});
  join("fabric", (millrace_participant_options){.fabric = "a*"});
  join("file", (millrace_participant_options){.fabric_config = "/nowhere.textproto"});
  join("level", (millrace_participant_options){.log_level = 9});
  options.size = 0;
  show("size", millrace_join(&options, &participant));

  options.size = sizeof options;
  options.log = write_log;
  options.log_context = (void*)"here";
  options.log_level = MILLRACE_LOG_DEBUG;
  show("join", millrace_join(&options, &participant));
  show("no uuid", serve(participant, (millrace_service_options){0}));
  show("wildcard", serve(participant, (millrace_service_options){.uuid = "a*"}));
  show("channel", serve(participant, (millrace_service_options){.uuid = "a", .channels = "cnc/0"}));
  show("calls",
       serve(participant, (millrace_service_options){.uuid = "a", .concurrent_calls = 257}));
  show("delivery", serve(participant, (millrace_service_options){.uuid = "a", .delivery = 2}));
  show("threads", serve(participant, (millrace_service_options){.uuid = "a", .threads = 1}));
  show("no discovery",
       millrace_request_send(participant,
                             &(millrace_request_options){.size = sizeof(millrace_request_options)},
                             &request));
  show("null call", millrace_call_answer(NULL, "", 0, 1));

  memset(&later, 0, sizeof later);
  later.known.size = sizeof later;
  later.known.uuid = "later";
  later.known.handler = never;
  show("later header", millrace_serve(participant, &later.known, &service));
  show("next with a handler", millrace_next(service, 0, &call));
  millrace_service_free(service);
  later.later = 1;
  show("later member", millrace_serve(participant, &later.known, &service));
  /* What a program has that was compiled with an earlier header: no handler, no threads. */
  later.known.size = offsetof(millrace_service_options, handler);
  show("earlier header", millrace_serve(participant, &later.known, &service));
  show("nothing", millrace_next(service, 0, &call));
  show("leave", millrace_leave(service));
  show("closed", millrace_next(service, MILLRACE_FOREVER, &call));

  child = fork();
  if (child == 0) {
    show("child", millrace_next(service, MILLRACE_FOREVER, &call));
    millrace_service_free(service);
    millrace_participant_free(participant);
    exit(0);
  }
  waitpid(child, NULL, 0);
  millrace_service_free(service);
  millrace_participant_free(participant);
  printf("%s, %s\n", millrace_version(), millrace_code_text(99));
  return 0;
}
