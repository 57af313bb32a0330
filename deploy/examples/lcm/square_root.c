/* A service in C that speaks LCM, the whole of it: answers with the square root of what it is given. It is done in
 * microseconds, so that one thread is enough; countdown.cpp shows what takes longer.
 *
 *   lcm-gen -c --c-cpath . --c-hpath . /usr/share/millrace/lcm/*.lcm
 *   cc -o square_root square_root.c millrace_*.c -llcm -lm
 *   millrace-lcm &                    # once per host
 *   ./square_root
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

#include "millrace_drain_t.h"
#include "millrace_presence_t.h"
#include "millrace_reply_t.h"
#include "millrace_request_t.h"

#define UUID "6c1f3f0a-54a4-4a43-9b8d-2f3a8c1f7e51"

static lcm_t *lcm;
static int64_t program; /* drawn once: which of several programs of this UUID is meant */
static int draining;

/* The last answer. A call that is asked for again was answered, but the answer was lost: it is not run again. */
static char answered[64], text[128];
static int64_t state;

static void run(const char *request) {
  char *end;
  double number = strtod(request, &end);
  if (end == request || *end != '\0' || number < 0) {
    snprintf(text, sizeof text, "ERROR: '%.80s' has no square root", request);
    state = 10;
  } else {
    snprintf(text, sizeof text, "%f", sqrt(number));
    state = 1;
  }
}

static void on_request(const lcm_recv_buf_t *buffer, const char *channel, const millrace_request_t *request,
                       void *user) {
  (void)buffer, (void)channel, (void)user;
  if (request->program != program) {
    return; /* another one's */
  }
  if (strcmp(answered, request->call.id) != 0) {
    run(request->text);
    snprintf(answered, sizeof answered, "%s", request->call.id);
  }
  millrace_reply_t reply = {.program = program, .call = request->call, .kind = MILLRACE_REPLY_T_FINAL,
                            .text = text, .state = state};
  millrace_reply_t_publish(lcm, "MILLRACE_REPLY." UUID, &reply);
}

static void on_drain(const lcm_recv_buf_t *buffer, const char *channel, const millrace_drain_t *drain, void *user) {
  (void)buffer, (void)channel, (void)user;
  draining = draining || drain->program == program;
}

static int64_t now(void) {
  struct timeval time;
  gettimeofday(&time, NULL);
  return (int64_t)time.tv_sec * 1000000 + time.tv_usec;
}

static void say_that_we_are_here(void) {
  millrace_presence_t presence = {.program = program, .utime = now(), .uuid = UUID, .name = "square_root",
                                  .description = "Square roots, over LCM", .version = "1", .channels = "",
                                  .delivery = MILLRACE_PRESENCE_T_AT_LEAST_ONCE, .concurrency = 1,
                                  .draining = (int8_t)draining};
  millrace_presence_t_publish(lcm, "MILLRACE_PRESENCE", &presence);
}

int main(void) {
  lcm = lcm_create("udpm://239.255.76.67:7667?ttl=0");
  if (lcm == NULL) {
    return 1; /* LCM has said why: most often there is no route for multicast, see docs/how-to/services-with-lcm.md */
  }
  program = now() << 12 ^ getpid();
  millrace_request_t_subscribe(lcm, "MILLRACE_REQUEST." UUID, on_request, NULL);
  millrace_drain_t_subscribe(lcm, "MILLRACE_DRAIN." UUID, on_drain, NULL);
  for (int64_t next = 0; !draining;) {
    if (now() >= next) {
      say_that_we_are_here();
      next = now() + 200000; /* five times a second */
    }
    if (lcm_handle_timeout(lcm, 50) < 0) {
      return 1;
    }
  }
  say_that_we_are_here(); /* draining now: nothing new comes */
  lcm_destroy(lcm);
  return 0;
}
