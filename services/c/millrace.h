/* clang-format off: it would join the lines of the examples */
/* The C interface of millrace: serve calls of NC programs, call services, observe a fabric.
 *
 *   #include <millrace.h>
 *   #include <stdio.h>
 *
 *   int main(void) {
 *     millrace_participant* participant;
 *     millrace_service* service;
 *     millrace_call* call;
 *     millrace_service_options options = {.size = sizeof options};
 *     options.uuid = "2b382e8f-107e-4957-a2cf-922e12c6cb98";
 *     options.name = "length";
 *     if (millrace_join(NULL, &participant) != MILLRACE_OK ||
 *         millrace_serve(participant, &options, &service) != MILLRACE_OK) {
 *       fprintf(stderr, "%s\n", millrace_error());
 *       return 1;
 *     }
 *     printf("ready: length serves %s\n", options.uuid);
 *     fflush(stdout);
 *     while (millrace_next(service, MILLRACE_FOREVER, &call) == MILLRACE_OK) {
 *       char text[16];
 *       snprintf(text, sizeof text, "%zu", millrace_call_get(call)->text_length);
 *       millrace_call_answer(call, text, MILLRACE_TERMINATED, 1);
 *       millrace_call_free(call);
 *     }
 *     millrace_service_free(service);
 *     millrace_participant_free(participant);
 *     return 0;
 *   }
 *
 * Compatibility. The functions and values of this header keep their meaning as long as the library
 * is libmillrace.so.1. Later versions add functions, values and members at the end of structs.
 *
 * Structs. The first member of each is its size in bytes. Set it to sizeof in a struct that you
 * pass; all other members may be 0. The size of a struct that the library returns tells which
 * members it has.
 *
 * Texts of calls are bytes of the controller's code page CP1252, at most 127, with a length; a NUL
 * follows those that the library returns. All other texts are UTF-8 and end with a NUL. Texts that
 * you pass are copied.
 *
 * Errors. A function that can fail returns a millrace_code. millrace_error() is the text of the
 * last error of the calling thread: what happened, where, and what was expected.
 *
 * Threads. Every function may be called from every thread. Nothing may use a handle while it is
 * freed. The order in which handles are freed does not matter.
 *
 * fork(). A child cannot use the handles of its parent: functions return MILLRACE_FORKED there, and
 * functions that free do nothing.
 */
/* clang-format on */
#ifndef MILLRACE_H
#define MILLRACE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define MILLRACE_API __attribute__((visibility("default")))
#else
#define MILLRACE_API
#endif

/* ---- Errors ---- */

typedef int32_t millrace_code;
#define MILLRACE_OK 0
/* An argument, an option, a file or a variable of the environment is wrong. */
#define MILLRACE_INVALID 1
/* The fabric cannot be joined. */
#define MILLRACE_NOT_CONNECTED 2
/* No call, response or event came within the time-out. */
#define MILLRACE_NOTHING 3
/* The service has left the fabric, or the observer is closed. */
#define MILLRACE_CLOSED 4
/* The call was answered or declined before. */
#define MILLRACE_ENDED 5
/* No instance on the fabric serves this UUID for this channel. */
#define MILLRACE_UNSERVED 6
/* No final response came within the time-out of a request. */
#define MILLRACE_NO_RESPONSE 7
/* millrace_request_wait: an interim response; wait again for the final one. */
#define MILLRACE_INTERIM 8
/* The handle belongs to the process that has forked this one. */
#define MILLRACE_FORKED 9
/* The process has no memory, thread or descriptor left, or DDS reports an error. */
#define MILLRACE_FAILED 10

/* The text of the last error of this thread; empty if there was none. Valid until its next error.
 */
MILLRACE_API const char* millrace_error(void);
/* What a code means, in English. */
MILLRACE_API const char* millrace_code_text(millrace_code code);
/* The version of the library, as "1.0.0". */
MILLRACE_API const char* millrace_version(void);

/* In place of the length of a text that ends with a NUL. */
#define MILLRACE_TERMINATED SIZE_MAX
/* In place of a time limit in milliseconds. */
#define MILLRACE_FOREVER UINT32_MAX

/* ---- Participant: this process on a fabric ---- */

typedef struct millrace_participant millrace_participant;

#define MILLRACE_LOG_ERROR 1
#define MILLRACE_LOG_WARN 2
#define MILLRACE_LOG_INFO 3
#define MILLRACE_LOG_DEBUG 4
#define MILLRACE_LOG_TRACE 5

/* `text` is UTF-8 without a line end, valid during the call. Called by one thread at a time, by any
 * thread of the library; must not wait and must not call the library. */
typedef void (*millrace_log_function)(int32_t level, const char* text, void* context);

typedef struct millrace_participant_options {
  size_t size;
  /* The file that describes the fabric (fabric.textproto). NULL: the file that
   * MILLRACE_FABRIC_CONFIG names, else /etc/millrace/fabric.textproto if it exists. Empty: no file.
   */
  const char* fabric_config;
  /* Nonzero: `domain` applies. 0: MILLRACE_DOMAIN, else the file, else 0. */
  int32_t use_domain;
  /* DDS domain, 0 to 232. */
  uint32_t domain;
  /* Name of the fabric. NULL: MILLRACE_FABRIC, else the file, else "millrace". */
  const char* fabric;
  /* Name of the process in tools and logs. NULL: the name of its program. */
  const char* name;
  /* Nonzero: this process also calls services, lists instances or observes calls. It then discovers
   * every other process; one that only serves is discovered by gateways and tools, which costs a
   * large fabric less. */
  int32_t discovers;
  /* MILLRACE_LOG_…; 0: MILLRACE_LOG_LEVEL, else MILLRACE_LOG_INFO. */
  int32_t log_level;
  /* Receives what the library logs. NULL: standard error, in the form that all services have. */
  millrace_log_function log;
  void* log_context;
} millrace_participant_options;

/* Joins a fabric. `options` may be NULL. MILLRACE_INVALID: an option, the environment or the file
 * is wrong; MILLRACE_NOT_CONNECTED: DDS refuses. */
MILLRACE_API millrace_code millrace_join(const millrace_participant_options* options,
                                         millrace_participant** participant);
/* Leaves the fabric once the handles that were made with the participant are freed. NULL is
 * allowed. */
MILLRACE_API void millrace_participant_free(millrace_participant* participant);
/* The DDS domain that was joined. */
MILLRACE_API uint32_t millrace_domain(const millrace_participant* participant);
/* Nonzero once the certificate of this process has expired or is revoked: its services drain, and
 * no other process accepts its samples. */
MILLRACE_API int32_t millrace_is_expired(const millrace_participant* participant);
/* Sends `lines`, "READY=1" for instance, to the supervisor that started the process (sd_notify(3)).
 * Nothing happens without one. */
MILLRACE_API void millrace_notify_supervisor(const char* lines);

/* ---- Service: an instance that answers the calls of a UUID ---- */

typedef struct millrace_service millrace_service;
typedef struct millrace_call millrace_call;

/* After a failure of an instance the gateway dispatches its call again. */
#define MILLRACE_AT_LEAST_ONCE 0
/* After a failure of an instance its call is blocked until an operator decides. */
#define MILLRACE_AT_MOST_ONCE 1

/* NC programs wait for RESPONSE_STATE. */
#define MILLRACE_RESPONSE_STATE 0
/* NC programs wait for a text in RESPONSE: a response needs a text, its state may be 0, and there
 * are not interim responses. */
#define MILLRACE_RESPONSE 1

/* Owns the call: it ends the call (answer, fail or decline) and frees it, now or later, in this or
 * another thread. */
typedef void (*millrace_handler)(millrace_call* call, void* context);

typedef struct millrace_service_options {
  size_t size;
  /* What NC programs write to V.G.SERVICE.UUID; upper and lower case are the same. Required. */
  const char* uuid;
  const char* name;
  const char* description;
  const char* version;
  /* Channels to serve, as "MACHINE/N" with blanks between; either part may be "*". NULL or empty:
   * all. */
  const char* channels;
  /* MILLRACE_AT_LEAST_ONCE or MILLRACE_AT_MOST_ONCE. */
  int32_t delivery;
  /* MILLRACE_RESPONSE_STATE or MILLRACE_RESPONSE. */
  int32_t completion;
  /* Calls that may be under way at the same time, 1 to 256; 0 stands for 1. */
  uint32_t concurrent_calls;
  /* State of a response that stands for an error of the service; 0 stands for 500. */
  uint32_t error_state;
  /* Called for each call. NULL: calls wait for millrace_next. */
  millrace_handler handler;
  void* handler_context;
  /* Threads that run `handler`, 1 to 256; 0 stands for 1. A handler that answers later needs fewer
   * threads than concurrent calls. */
  uint32_t threads;
} millrace_service_options;

/* Serves from now on. Services of one participant share its loop and its heartbeat. */
MILLRACE_API millrace_code millrace_serve(millrace_participant* participant,
                                          const millrace_service_options* options,
                                          millrace_service** service);
/* UUID in canonical form, and id of the instance; valid as long as the handle. */
MILLRACE_API const char* millrace_service_uuid(const millrace_service* service);
MILLRACE_API const char* millrace_service_instance(const millrace_service* service);

/* Waits for a call. MILLRACE_NOTHING: none came within `timeout_ms`; MILLRACE_CLOSED: the service
 * has drained or left, and no call will come. Free the call when it has ended. */
MILLRACE_API millrace_code millrace_next(millrace_service* service, uint32_t timeout_ms,
                                         millrace_call** call);

/* Takes no new call; calls under way may end. Returns at once. An operator's drain command does the
 * same. */
MILLRACE_API millrace_code millrace_drain(millrace_service* service);
/* For a service with a handler: waits until it has drained, then leaves the fabric.
 * MILLRACE_NOTHING: calls are still under way after `timeout_ms`. Not in a handler. */
MILLRACE_API millrace_code millrace_wait(millrace_service* service, uint32_t timeout_ms);
/* Leaves the fabric at once: responses to calls under way are lost, and gateways treat these calls
 * as after a crash. millrace_next returns MILLRACE_CLOSED. Not in a handler. */
MILLRACE_API millrace_code millrace_leave(millrace_service* service);
/* As millrace_leave; waits for handlers that run. NULL is allowed. Not in a handler. */
MILLRACE_API void millrace_service_free(millrace_service* service);

/* ---- Call: as a service sees it ---- */

typedef struct millrace_call_info {
  size_t size;
  /* V.G.SERVICE.REQUEST. */
  const char* text;
  size_t text_length;
  /* V.G.SERVICE.REQUEST_STATE. */
  uint32_t state;
  /* V.G.SERVICE.UUID as the NC program wrote it. */
  const char* uuid;
  const char* machine;
  uint16_t channel;
  /* 1, 2, …: higher than 1 if another instance may have run the call before. */
  uint32_t attempt;
  /* Unique for ever, the same in every attempt. */
  const char* call_id;
  /* After it a response has no use: nanoseconds since 1970-01-01T00:00:00Z; 0: no deadline. */
  int64_t deadline_ns;
  /* Nonzero: the call is replayed from a recording; no NC program waits for it. */
  int32_t replayed;
} millrace_call_info;

/* Valid until the call is freed. */
MILLRACE_API const millrace_call_info* millrace_call_get(const millrace_call* call);

/* Nonzero once the NC program has withdrawn its request. A response has no use then; end the call
 * all the same. */
MILLRACE_API int32_t millrace_call_cancelled(const millrace_call* call);
/* Calls `function` once, when the call is cancelled; at once if it is. In a thread of the library;
 * must not wait. May end the call, may not free it. millrace_call_free waits until it has returned.
 * One function for each call. */
MILLRACE_API millrace_code millrace_call_on_cancelled(
    millrace_call* call, void (*function)(millrace_call* call, void* context), void* context);

/* Writes RESPONSE and RESPONSE_STATE; the NC program goes on waiting. No effect after the end of
 * the call, after its cancellation, and for programs that wait for RESPONSE. */
MILLRACE_API millrace_code millrace_call_interim(millrace_call* call, const char* text,
                                                 size_t text_length, uint32_t state);

/* Each of these three ends the call; MILLRACE_ENDED if it has ended before. */

/* With a response: at most 127 bytes without NUL, and a state other than 0 (MILLRACE_RESPONSE: a
 * text). Any other response ends the call with an error text and the error state, and returns
 * MILLRACE_INVALID. */
MILLRACE_API millrace_code millrace_call_answer(millrace_call* call, const char* text,
                                                size_t text_length, uint32_t state);
/* With "ERROR: " and `reason` (CP1252), and the error state. A text that does not fit ends in
 * "...". */
MILLRACE_API millrace_code millrace_call_fail(millrace_call* call, const char* reason,
                                              size_t reason_length);
/* Gives back an attempt of which nothing was begun: the gateway dispatches the call to another
 * instance. `reason` goes to logs. */
MILLRACE_API millrace_code millrace_call_decline(millrace_call* call, const char* reason,
                                                 size_t reason_length);

/* Frees the handle. A call that has not ended gets an error response. NULL is allowed. */
MILLRACE_API void millrace_call_free(millrace_call* call);

/* ---- Request: call a service without a controller. The participant must discover others
 * (`discovers`). ---- */

typedef struct millrace_request millrace_request;

typedef struct millrace_request_options {
  size_t size;
  const char* uuid;
  const char* text;
  size_t text_length;
  /* REQUEST_STATE; 0 stands for 1. */
  uint32_t state;
  /* Chooses the instance as for a call of this channel. NULL: any instance. */
  const char* machine;
  /* 0 stands for 1. */
  uint16_t channel;
  /* From the request to the final response; 0 stands for 10,000. */
  uint32_t timeout_ms;
} millrace_request_options;

#define MILLRACE_RESULT_OK 0
/* The handler threw an exception or failed. */
#define MILLRACE_RESULT_FAILED 1
/* From memory: the service has run the call before. */
#define MILLRACE_RESULT_REPEATED 2
/* The service gave a response that cannot be sent; `text` says why. */
#define MILLRACE_RESULT_REFUSED 3

typedef struct millrace_response {
  size_t size;
  const char* text;
  size_t text_length;
  uint32_t state;
  /* MILLRACE_RESULT_… */
  int32_t result;
  const char* instance;
  const char* call_id;
  /* From the dispatch to the final response, in nanoseconds; 0 for an interim one. */
  int64_t duration_ns;
} millrace_response;

/* Calls a service; returns at once. */
MILLRACE_API millrace_code millrace_request_send(millrace_participant* participant,
                                                 const millrace_request_options* options,
                                                 millrace_request** request);
/* Waits for the next response. MILLRACE_OK: the final one; MILLRACE_INTERIM: an interim one;
 * MILLRACE_NOTHING: none within `timeout_ms`; MILLRACE_UNSERVED, MILLRACE_NO_RESPONSE: there will
 * be none. `*response` is valid until the next wait or until the request is freed. By one thread at
 * a time. */
MILLRACE_API millrace_code millrace_request_wait(millrace_request* request, uint32_t timeout_ms,
                                                 const millrace_response** response);
/* Cancels the call if it has not ended. NULL is allowed. */
MILLRACE_API void millrace_request_free(millrace_request* request);

/* ---- Instances ---- */

typedef struct millrace_instances millrace_instances;

typedef struct millrace_instance {
  size_t size;
  const char* id;
  const char* uuid;
  const char* name;
  const char* description;
  const char* version;
  const char* host;
  uint32_t pid;
  /* As in millrace_service_options; empty: all. */
  const char* channels;
  int32_t delivery;
  int32_t completion;
  uint32_t concurrent_calls;
  int32_t draining;
  /* The subject of its certificate; empty on a fabric without trust. */
  const char* certificate;
  uint32_t running;
  uint32_t waiting;
  uint64_t answered;
  uint64_t failed;
  /* Mean time in handlers. */
  int64_t mean_ns;
} millrace_instance;

/* Listens until no further instance appears, 0.7 to 5 s. The participant must discover others
 * (`discovers`). */
MILLRACE_API millrace_code millrace_list(millrace_participant* participant,
                                         millrace_instances** instances);
MILLRACE_API size_t millrace_instances_count(const millrace_instances* instances);
/* NULL beyond the end; valid as long as the list. */
MILLRACE_API const millrace_instance* millrace_instances_at(const millrace_instances* instances,
                                                            size_t index);
MILLRACE_API void millrace_instances_free(millrace_instances* instances);

/* ---- Observer: calls and alarms as they happen. The participant must discover others
 * (`discovers`). ---- */

typedef struct millrace_observer millrace_observer;

#define MILLRACE_OBSERVE_CALLS 1
#define MILLRACE_OBSERVE_ALARMS 2

typedef struct millrace_observer_options {
  size_t size;
  /* MILLRACE_OBSERVE_… added; 0 stands for all. */
  uint32_t what;
  /* Events that may wait for millrace_observe; 0 stands for 65,536. Further ones are lost and
   * counted. */
  uint32_t capacity;
} millrace_observer_options;

typedef struct millrace_event {
  size_t size;
  /* A step of a call: "seen", "unserved", "dispatched", "interim", "replied", "written",
   * "withdrawn", "lost", "late", "refused", "held". An alarm: "alarm", "alarm over". */
  const char* kind;
  /* When, by the clock of the host that reports it: nanoseconds since 1970-01-01T00:00:00Z. */
  int64_t time_ns;
  /* Events lost before this one. */
  uint64_t lost;

  /* Of a call; empty or 0 in an alarm. */
  const char* machine;
  uint16_t channel;
  const char* call_id;
  uint32_t attempt;
  const char* uuid;
  /* CP1252; text of the request or of the response. */
  const char* text;
  size_t text_length;
  uint32_t state;
  int32_t replayed;

  /* Id of the instance that has the call, or of the process that reports the alarm; may be empty.
   */
  const char* instance;
  /* Why; of an alarm what is the matter. */
  const char* detail;

  /* Of an alarm; empty in a call. `level` is "fine", "warning" or "problem". */
  const char* level;
  const char* alarm;
  const char* subject;
  const char* remedy;
  const char* process;
  const char* host;
  uint32_t pid;
} millrace_event;

MILLRACE_API millrace_code millrace_observer_open(millrace_participant* participant,
                                                  const millrace_observer_options* options,
                                                  millrace_observer** observer);
/* Waits for an event. `*event` is valid until the next wait or until the observer is freed. By one
 * thread at a time. MILLRACE_NOTHING: none within `timeout_ms`. */
MILLRACE_API millrace_code millrace_observe(millrace_observer* observer, uint32_t timeout_ms,
                                            const millrace_event** event);
MILLRACE_API void millrace_observer_free(millrace_observer* observer);

/* ---- Recordings of `millrace record`. No participant is needed. ---- */

typedef struct millrace_recording millrace_recording;

/* In place of a duration that the recording does not show. */
#define MILLRACE_UNKNOWN INT64_MIN

typedef struct millrace_recorded_call {
  size_t size;
  const char* call_id;
  const char* machine;
  uint16_t channel;
  const char* uuid;
  /* "answered" by a service; "failed": its last attempt did; "settled" by the gateway or an
   * operator; "withdrawn" by the NC program; "under way" at the end of the recording. */
  const char* outcome;
  /* The last attempt, and the instance that had it; name and host may be empty. */
  uint32_t attempt;
  const char* instance;
  const char* name;
  const char* host;
  /* CP1252; empty if it is not recorded, or not written. */
  const char* request;
  size_t request_length;
  uint32_t request_state;
  const char* response;
  size_t response_length;
  uint32_t response_state;
  /* Why it ended. */
  const char* detail;
  int32_t replayed;
  /* When the gateway saw it, and when it ended: nanoseconds since 1970-01-01T00:00:00Z; 0: not
   * recorded. */
  int64_t seen_ns;
  int64_t ended_ns;
  /* Durations in nanoseconds or MILLRACE_UNKNOWN, of the attempt whose response was written.
   * Between gateway and service two clocks are compared: these may be negative. */
  int64_t dispatch_ns;
  int64_t to_service_ns;
  /* From its receipt to the start of the handler. */
  int64_t queue_ns;
  int64_t work_ns;
  int64_t to_gateway_ns;
  int64_t write_back_ns;
  int64_t total_ns;
  /* For millrace_recording_step. */
  size_t steps;
} millrace_recorded_call;

typedef struct millrace_step {
  size_t size;
  /* "seen by the gateway", "dispatched", "handler started", ... */
  const char* name;
  int64_t time_ns;
  /* Nonzero: by the clock of the service's host. */
  int32_t by_service;
  uint32_t attempt;
  const char* instance;
  /* CP1252. */
  const char* text;
  size_t text_length;
  uint32_t state;
  const char* detail;
} millrace_step;

/* Reads the file in a thread of the library. MILLRACE_INVALID: it cannot be opened. */
MILLRACE_API millrace_code millrace_recording_open(const char* file,
                                                   millrace_recording** recording);
/* The next call, in the order of their ends; those under way come last. MILLRACE_NOTHING: that was
 * the last one. `*call` is valid until the next call or until the recording is freed. By one thread
 * at a time. */
MILLRACE_API millrace_code millrace_recording_next(millrace_recording* recording,
                                                   const millrace_recorded_call** call);
/* A step of that call, in the order in which they happened; NULL beyond the last one. */
MILLRACE_API const millrace_step* millrace_recording_step(const millrace_recording* recording,
                                                          size_t index);
/* After the last call: a damaged place of the file, as "at byte 4711: ..."; NULL beyond the last
 * one. */
MILLRACE_API const char* millrace_recording_problem(const millrace_recording* recording,
                                                    size_t index);
/* NULL is allowed. */
MILLRACE_API void millrace_recording_free(millrace_recording* recording);

#ifdef __cplusplus
}
#endif

#endif /* MILLRACE_H */
