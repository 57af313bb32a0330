/* The other side in C for tests.
 *
 *   c_client call UUID TEXT      responses, or the error
 *   c_client list                instances
 *   c_client observe UUID TEXT   calls, then the events of the call up to the response
 *   c_client recording FILE      the calls of a recording
 */
#include <millrace.h>
#include <stdio.h>
#include <string.h>

static int failed(millrace_code code) {
  printf("error %d: %s\n", code, millrace_error());
  return 1;
}

static int call(millrace_participant* participant, const char* uuid, const char* text) {
  millrace_request_options options = {.size = sizeof options};
  const millrace_response* response;
  millrace_request* request;
  millrace_code code;
  options.uuid = uuid;
  options.text = text;
  options.text_length = MILLRACE_TERMINATED;
  options.timeout_ms = 5000;
  if ((code = millrace_request_send(participant, &options, &request)) != MILLRACE_OK) {
    return failed(code);
  }
  while ((code = millrace_request_wait(request, MILLRACE_FOREVER, &response)) == MILLRACE_INTERIM) {
    printf("interim: %s, state %u\n", response->text, response->state);
  }
  if (code == MILLRACE_OK) {
    printf("final: %s, state %u, result %d, in time %d\n", response->text, response->state,
           response->result, response->duration_ns > 0);
  } else {
    failed(code);
  }
  millrace_request_free(request);
  return code == MILLRACE_OK ? 0 : 1;
}

static int list(millrace_participant* participant) {
  millrace_instances* instances;
  millrace_code code = millrace_list(participant, &instances);
  if (code != MILLRACE_OK) {
    return failed(code);
  }
  for (size_t i = 0; i < millrace_instances_count(instances); ++i) {
    const millrace_instance* one = millrace_instances_at(instances, i);
    printf("%s %s pid %u channels '%s' delivery %d completion %d calls %u\n", one->uuid, one->name,
           one->pid, one->channels, one->delivery, one->completion, one->concurrent_calls);
  }
  printf("beyond: %d\n",
         millrace_instances_at(instances, millrace_instances_count(instances)) == NULL);
  millrace_instances_free(instances);
  return 0;
}

static int observe(millrace_participant* participant, const char* uuid, const char* text) {
  millrace_observer* observer;
  const millrace_event* event;
  millrace_code code = millrace_observer_open(participant, NULL, &observer);
  if (code != MILLRACE_OK) {
    return failed(code);
  }
  call(participant, uuid, text);
  do {
    if ((code = millrace_observe(observer, 5000, &event)) != MILLRACE_OK) {
      failed(code);
      break;
    }
    printf("%s: %s/%u %s state %u %s%s%s\n", event->kind, event->machine, event->channel,
           event->text, event->state, event->level, event->alarm, event->detail);
  } while (strcmp(event->kind, "replied") != 0);
  millrace_observer_free(observer);
  return code == MILLRACE_OK ? 0 : 1;
}

static int read_recording(const char* file) {
  millrace_recording* recording;
  const millrace_recorded_call* call;
  const char* problem;
  millrace_code code = millrace_recording_open(file, &recording);
  if (code != MILLRACE_OK) {
    return failed(code);
  }
  while ((code = millrace_recording_next(recording, &call)) == MILLRACE_OK) {
    printf("%s/%u %s -> %s, state %u, %s by %s, total %d, first: %s, beyond: %d\n", call->machine,
           call->channel, call->request, call->response, call->response_state, call->outcome,
           call->name, call->total_ns > 0, millrace_recording_step(recording, 0)->name,
           millrace_recording_step(recording, call->steps) == NULL);
  }
  for (size_t i = 0; (problem = millrace_recording_problem(recording, i)) != NULL; ++i) {
    printf("problem: %s\n", problem);
  }
  millrace_recording_free(recording);
  return code == MILLRACE_NOTHING ? 0 : failed(code);
}

int main(int argc, char** argv) {
  millrace_participant* participant;
  millrace_participant_options options = {.size = sizeof options};
  int result = 2;
  millrace_code code;
  if (argc == 3 && strcmp(argv[1], "recording") == 0) {
    return read_recording(argv[2]);
  }
  options.name = "c_client";
  options.discovers = 1;
  if ((code = millrace_join(&options, &participant)) != MILLRACE_OK) {
    return failed(code);
  }
  if (argc == 4 && strcmp(argv[1], "call") == 0) {
    result = call(participant, argv[2], argv[3]);
  } else if (argc == 2 && strcmp(argv[1], "list") == 0) {
    result = list(participant);
  } else if (argc == 4 && strcmp(argv[1], "observe") == 0) {
    result = observe(participant, argv[2], argv[3]);
  }
  millrace_participant_free(participant);
  return result;
}
