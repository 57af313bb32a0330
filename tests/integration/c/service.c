/* A service in C for tests: two UUIDs on one participant. The first has a handler that does what
 * its request says, on two threads, for four calls at a time. The calls of the second are taken by
 * main.
 *
 *   c_service UUID UUID       until SIGTERM; MILLRACE_DOMAIN and so on choose the fabric
 */
#include <millrace.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { most_kept = 8 };

static volatile sig_atomic_t stopped = 0;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static millrace_call* kept[most_kept];
static int kept_count = 0;

static void stop(int number) {
  (void)number;
  stopped = 1;
}

static void check(millrace_code code) {
  if (code != MILLRACE_OK) {
    fprintf(stderr, "%s: %s\n", millrace_code_text(code), millrace_error());
    exit(1);
  }
}

static void say(const char* what) {
  printf("%s\n", what);
  fflush(stdout);
}

static void keep(millrace_call* call) {
  pthread_mutex_lock(&lock);
  kept[kept_count++ % most_kept] = call;
  pthread_mutex_unlock(&lock);
}

/* Answers what is kept, with the request itself. */
static void release(void) {
  pthread_mutex_lock(&lock);
  while (kept_count > 0) {
    millrace_call* call = kept[--kept_count];
    const millrace_call_info* info = millrace_call_get(call);
    check(millrace_call_answer(call, info->text, info->text_length, info->channel));
    millrace_call_free(call);
  }
  pthread_mutex_unlock(&lock);
}

static void on_cancelled(millrace_call* call, void* context) {
  printf("%s: %s is cancelled: %d\n", (const char*)context, millrace_call_get(call)->text,
         millrace_call_cancelled(call));
  fflush(stdout);
  check(millrace_call_fail(call, "stopped", MILLRACE_TERMINATED));
}

static void obey(millrace_call* call, void* context) {
  const millrace_call_info* info = millrace_call_get(call);
  const char* request = info->text;
  char text[128];
  if (strcmp(request, "keep") == 0) {
    keep(call);
    return;
  }
  if (strcmp(request, "wait") == 0) {
    check(millrace_call_on_cancelled(call, on_cancelled, context));
    say("waiting");
    keep(call);
    return;
  }
  if (strcmp(request, "release") == 0) {
    release();
    check(millrace_call_answer(call, "released", MILLRACE_TERMINATED, 1));
  } else if (strcmp(request, "who") == 0) {
    snprintf(text, sizeof text, "%s/%u attempt %u state %u id %s replayed %d deadline %d",
             info->machine, info->channel, info->attempt, info->state, info->call_id,
             info->replayed, info->deadline_ns != 0);
    check(millrace_call_answer(call, text, MILLRACE_TERMINATED, info->state + 1));
  } else if (strcmp(request, "interim") == 0) {
    check(millrace_call_interim(call, "half way", MILLRACE_TERMINATED, 50));
    check(millrace_call_answer(call, "all the way", MILLRACE_TERMINATED, 1));
  } else if (strcmp(request, "decline") == 0 && info->attempt == 1) {
    check(millrace_call_decline(call, "not the first time", MILLRACE_TERMINATED));
  } else if (strcmp(request, "fail") == 0) {
    check(millrace_call_fail(call, "the gauge is off", MILLRACE_TERMINATED));
  } else if (strcmp(request, "long") == 0) {
    char much[200];
    memset(much, 'x', sizeof much);
    printf("long: %d: ", millrace_call_answer(call, much, sizeof much, 1));
    say(millrace_error());
  } else if (strcmp(request, "twice") == 0) {
    check(millrace_call_answer(call, "once", 4, 1));
    printf("twice: %d: ", millrace_call_answer(call, "twice", MILLRACE_TERMINATED, 1));
    say(millrace_error());
  } else if (strcmp(request, "drop") != 0) {
    snprintf(text, sizeof text, "%s, attempt %u", request, info->attempt);
    check(millrace_call_answer(call, text, MILLRACE_TERMINATED, 1));
  }
  millrace_call_free(call);
}

int main(int argc, char** argv) {
  millrace_participant* participant;
  millrace_service* first;
  millrace_service* second;
  millrace_call* call;
  millrace_code code;
  millrace_service_options options = {.size = sizeof options};
  if (argc != 3) {
    return 2;
  }
  signal(SIGTERM, stop);
  check(millrace_join(NULL, &participant));
  options.uuid = argv[1];
  options.name = "obedient";
  options.channels = "cnc/* press/1 */1";
  options.concurrent_calls = 4;
  options.threads = 2;
  options.handler = obey;
  options.handler_context = (void*)"obedient";
  check(millrace_serve(participant, &options, &first));
  memset(&options, 0, sizeof options);
  options.size = sizeof options;
  options.uuid = argv[2];
  options.name = "length";
  options.delivery = MILLRACE_AT_MOST_ONCE;
  options.completion = MILLRACE_RESPONSE;
  check(millrace_serve(participant, &options, &second));
  /* Its services keep what they need of it. */
  millrace_participant_free(participant);
  printf("ready: %s %s\n", millrace_service_uuid(first), millrace_service_instance(second));
  fflush(stdout);
  while ((code = millrace_next(second, 20, &call)) != MILLRACE_CLOSED) {
    if (code == MILLRACE_OK) {
      char text[16];
      snprintf(text, sizeof text, "%zu", millrace_call_get(call)->text_length);
      check(millrace_call_answer(call, text, MILLRACE_TERMINATED, 0));
      millrace_call_free(call);
    }
    if (stopped == 1) {
      stopped = 2;
      check(millrace_drain(first));
      check(millrace_drain(second));
    }
  }
  say("second drained");
  printf("first: %d\n", millrace_wait(first, 0));
  release();
  check(millrace_wait(first, MILLRACE_FOREVER));
  say("first drained");
  millrace_service_free(first);
  millrace_service_free(second);
  return 0;
}
