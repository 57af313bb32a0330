/* A service and a caller of another make as of 1.0: plain C on Cyclone DDS, from the frozen types
 * (1.0/idl) and docs/reference/wire.md alone. Nothing in here knows of millrace's sources.
 *
 *   past_peer serve DOMAIN UUID            answers each request with its own text, until SIGTERM
 *   past_peer call DOMAIN UUID TEXT...     calls the first instance that is found with each text
 */
#include <dds/dds.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/compat/millrace.h"

static const char* const configuration =
    "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces>"
    "<AllowMulticast>spdp</AllowMulticast></General>"
    "<Internal><GenerateKeyhash>true</GenerateKeyhash></Internal>";

enum { id_size = 16, text_of_id = 37, most_keys = 64, lease_ms = 1500 };

static int32_t checked(int32_t result, const char* what) {
  if (result < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(result));
    exit(1);
  }
  return result;
}

static void draw(void* bytes, size_t size) {
  FILE* const random = fopen("/dev/urandom", "rb");
  if (random == NULL || fread(bytes, 1, size, random) != size) {
    perror("/dev/urandom");
    exit(1);
  }
  fclose(random);
}

/* A version 4 UUID and its text. */
static void draw_id(uint8_t* id, char* text) {
  draw(id, id_size);
  id[6] = (uint8_t)((id[6] & 0x0F) | 0x40);
  id[8] = (uint8_t)((id[8] & 0x3F) | 0x80);
  for (int i = 0; i < id_size; ++i) {
    text += sprintf(text, i == 4 || i == 6 || i == 8 || i == 10 ? "-%02x" : "%02x", id[i]);
  }
}

typedef struct {
  const char* name;
  const dds_topic_descriptor_t* type;
  bool is_reliable;
} Topic;

static const Topic request_topic = {"millrace/v5/request", &millrace_Request_desc, true};
static const Topic reply_topic = {"millrace/v5/reply", &millrace_Reply_desc, true};
static const Topic heartbeat_topic = {"millrace/v5/heartbeat", &millrace_Heartbeat_desc, false};

typedef dds_entity_t Create(dds_entity_t, const dds_qos_t*, const dds_listener_t*);
typedef dds_entity_t Open(dds_entity_t, dds_entity_t, const dds_qos_t*, const dds_listener_t*);

/* An endpoint in one partition. */
static dds_entity_t open_in(dds_entity_t participant, const Topic* topic, const char* partition,
                            const char* user_data, bool is_writer) {
  Create* const create = is_writer ? dds_create_publisher : dds_create_subscriber;
  Open* const open = is_writer ? dds_create_writer : dds_create_reader;
  dds_qos_t* const of_group = dds_create_qos();
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_partition1(of_group, partition);
  dds_qset_reliability(
      qos, topic->is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(
      qos, topic->is_reliable ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_writer_data_lifecycle(qos, false);
  dds_qset_userdata(qos, user_data, strlen(user_data));
  const dds_entity_t group = checked(create(participant, of_group, NULL), "create a group");
  const dds_entity_t described = checked(
      dds_create_topic(participant, topic->type, topic->name, NULL, NULL), "create a topic");
  const dds_entity_t opened = checked(open(group, described, qos, NULL), topic->name);
  dds_delete_qos(of_group);
  dds_delete_qos(qos);
  return opened;
}

static dds_entity_t join(uint32_t domain, int64_t lease) {
  checked(dds_create_domain(domain, configuration), "create the domain");
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, lease);
  const dds_entity_t participant =
      checked(dds_create_participant(domain, qos, NULL), "join the domain");
  dds_delete_qos(qos);
  return participant;
}

static volatile sig_atomic_t is_over = 0;
static void end(int number) {
  (void)number;
  is_over = 1;
}

static bool is_equal(const uint8_t* one, size_t size, const uint8_t* other, size_t other_size) {
  return size == other_size && (size == 0 || memcmp(one, other, size) == 0);
}

/* The last reply to each machine, channel and epoch. */
typedef struct {
  millrace_Reply reply;
  uint8_t text[128];
  size_t size;
  char uuid[128];
} Answered;

typedef struct {
  uint8_t id[id_size];
  uint8_t process[id_size];
  dds_entity_t replies;
  dds_entity_t heartbeats;
  Answered answered[most_keys];
  size_t keys;
} Service;

static void* send_heartbeats(void* argument) {
  const Service* const service = argument;
  while (!is_over) {
    millrace_Heartbeat heartbeat;
    memset(&heartbeat, 0, sizeof heartbeat);
    memcpy(heartbeat.process, service->process, id_size);
    heartbeat.at = dds_time();
    checked(dds_write(service->heartbeats, &heartbeat), "write a heartbeat");
    dds_sleepfor(DDS_MSECS(lease_ms / 4));
  }
  return NULL;
}

/* Where the reply to this machine, channel and epoch is. */
static Answered* find_key(Service* service, const millrace_Request* request) {
  for (size_t i = 0; i < service->keys; ++i) {
    const millrace_Reply* const reply = &service->answered[i].reply;
    if (reply->epoch == request->epoch && reply->channel == request->channel &&
        strcmp(reply->machine, request->machine) == 0) {
      return &service->answered[i];
    }
  }
  if (service->keys == most_keys) {
    fprintf(stderr, "there are more than %d channels\n", most_keys);
    exit(1);
  }
  return &service->answered[service->keys++];
}

static bool is_answered(const Answered* known, const millrace_Request* request) {
  return known->reply.number == request->number && known->reply.attempt != 0 &&
         known->reply.asked_state == request->state && strcmp(known->uuid, request->uuid) == 0 &&
         is_equal(known->text, known->size, request->text._buffer, request->text._length);
}

static void take_request(Service* service, const millrace_Request* request) {
  if (memcmp(request->assigned, service->id, id_size) != 0 || request->attempt == 0) {
    return;
  }
  Answered* const known = find_key(service, request);
  millrace_Reply* const reply = &known->reply;
  if (is_answered(known, request)) {
    reply->code = millrace_service_code_repeated;
    printf("repeated %.*s\n", (int)known->size, (const char*)known->text);
  } else {
    memset(known, 0, sizeof *known);
    known->size = request->text._length;
    memcpy(known->text, request->text._buffer, known->size);
    strcpy(known->uuid, request->uuid);
    strcpy(reply->machine, request->machine);
    reply->channel = request->channel;
    memcpy(reply->instance, service->id, id_size);
    reply->epoch = request->epoch;
    reply->number = request->number;
    reply->kind = millrace_reply_kind_final;
    reply->code = millrace_service_code_ok;
    reply->state = 1;
    reply->asked_state = request->state;
    reply->received = reply->started = reply->answered = dds_time();
    reply->text._buffer = reply->asked_text._buffer = known->text;
    reply->text._length = reply->asked_text._length = (uint32_t)known->size;
    printf("run %.*s\n", (int)known->size, (const char*)known->text);
  }
  fflush(stdout);
  reply->attempt = request->attempt;
  checked(dds_write(service->replies, reply), "write a reply");
}

static int serve(uint32_t domain, const char* uuid) {
  static Service service;
  const dds_entity_t participant = join(domain, DDS_SECS(10));
  char instance[text_of_id];
  char of_process[text_of_id];
  char partition[128];
  char user_data[512];
  draw_id(service.id, instance);
  draw_id(service.process, of_process);

  snprintf(partition, sizeof partition, "millrace/%s", uuid);
  snprintf(user_data, sizeof user_data, "instance=%s", instance);
  service.replies = open_in(participant, &reply_topic, partition, user_data, true);
  service.heartbeats = open_in(participant, &heartbeat_topic, "millrace", "", true);
  snprintf(partition, sizeof partition, "millrace/%s/%s", uuid, instance);
  snprintf(user_data, sizeof user_data,
           "millrace-instance 2\nid=%s\nuuid=%s\nname=past\nhost=past-pc\npid=%d\nlease_ms=%d\n",
           instance, uuid, (int)getpid(), lease_ms);
  const dds_entity_t requests = open_in(participant, &request_topic, partition, user_data, false);

  pthread_t heart;
  checked(-pthread_create(&heart, NULL, send_heartbeats, &service), "start the heartbeats");
  printf("ready: %s\n", instance);
  fflush(stdout);
  while (!is_over) {
    void* samples[1] = {NULL};
    dds_sample_info_t info;
    const int32_t count = checked(dds_take(requests, samples, &info, 1, 1), "take a request");
    if (count == 0) {
      dds_sleepfor(DDS_MSECS(1));
    } else {
      if (info.valid_data) {
        take_request(&service, samples[0]);
      }
      dds_return_loan(requests, samples, count);
    }
  }
  /* A gateway that was killed acknowledges nothing. */
  (void)dds_wait_for_acks(service.replies, DDS_SECS(1));
  pthread_join(heart, NULL);
  checked(dds_delete(participant), "leave");
  return 0;
}

/* The id of an instance of this UUID, from the announcements; false if none is there yet. */
static bool find_instance(dds_entity_t announcements, const char* uuid, char* instance) {
  void* samples[1] = {NULL};
  dds_sample_info_t info;
  bool is_found = false;
  while (!is_found &&
         checked(dds_take(announcements, samples, &info, 1, 1), "read announcements") > 0) {
    const dds_builtintopic_endpoint_t* const reader = samples[0];
    void* data = NULL;
    size_t size = 0;
    if (info.valid_data && strcmp(reader->topic_name, request_topic.name) == 0 &&
        dds_qget_userdata(reader->qos, &data, &size) && data != NULL) {
      char text[4096] = "";
      char line[64];
      memcpy(text, data, size < sizeof text ? size : sizeof text - 1);
      snprintf(line, sizeof line, "\nuuid=%s\n", uuid);
      const char* const id = strstr(text, "\nid=");
      is_found = id != NULL && strstr(text, line) != NULL && strstr(text, "\ndraining=yes") == NULL;
      if (is_found) {
        snprintf(instance, text_of_id, "%.36s", id + strlen("\nid="));
      }
    }
    dds_free(data);
    dds_return_loan(announcements, samples, 1);
  }
  return is_found;
}

static void parse_id(const char* text, uint8_t* id) {
  for (int i = 0; i < id_size; ++i) {
    char digits[3] = "";
    text += *text == '-' ? 1 : 0;
    memcpy(digits, text, 2);
    id[i] = (uint8_t)strtoul(digits, NULL, 16);
    text += 2;
  }
}

/* Waits for the final reply to `request` and prints it. */
static void await_reply(dds_entity_t replies, const millrace_Request* request, int64_t deadline) {
  while (dds_time() < deadline) {
    void* samples[1] = {NULL};
    dds_sample_info_t info;
    const int32_t count = checked(dds_take(replies, samples, &info, 1, 1), "take a reply");
    if (count == 0) {
      dds_sleepfor(DDS_MSECS(1));
      continue;
    }
    const millrace_Reply* const reply = samples[0];
    const bool is_it = info.valid_data && reply->kind == millrace_reply_kind_final &&
                       reply->epoch == request->epoch && reply->number == request->number &&
                       reply->asked_state == request->state &&
                       is_equal(reply->asked_text._buffer, reply->asked_text._length,
                                request->text._buffer, request->text._length);
    if (is_it) {
      printf("response = %.*s, state = %u, code = %u\n", (int)reply->text._length,
             (const char*)reply->text._buffer, (unsigned)reply->state, (unsigned)reply->code);
    }
    dds_return_loan(replies, samples, count);
    if (is_it) {
      return;
    }
  }
  fprintf(stderr, "no reply\n");
  exit(1);
}

static int call(uint32_t domain, const char* uuid, char** texts, int count) {
  const int64_t deadline = dds_time() + DDS_SECS(20);
  const dds_entity_t participant = join(domain, DDS_SECS(100));
  const dds_entity_t announcements = checked(
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, NULL, NULL), "discover");
  char instance[text_of_id];
  char partition[128];
  while (!find_instance(announcements, uuid, instance)) {
    if (dds_time() > deadline) {
      fprintf(stderr, "no instance of %s\n", uuid);
      return 1;
    }
    dds_sleepfor(DDS_MSECS(10));
  }
  snprintf(partition, sizeof partition, "millrace/%s", uuid);
  const dds_entity_t replies = open_in(participant, &reply_topic, partition, "", false);
  snprintf(partition, sizeof partition, "millrace/%s/%s", uuid, instance);
  const dds_entity_t requests = open_in(participant, &request_topic, partition, "", true);
  dds_publication_matched_status_t readers = {0};
  dds_subscription_matched_status_t writers = {0};
  while (readers.current_count == 0 || writers.current_count == 0) {
    if (dds_time() > deadline) {
      fprintf(stderr, "the endpoints of %s do not match\n", instance);
      return 1;
    }
    checked(dds_get_publication_matched_status(requests, &readers), "count readers");
    checked(dds_get_subscription_matched_status(replies, &writers), "count writers");
    dds_sleepfor(DDS_MSECS(10));
  }

  millrace_Request request;
  memset(&request, 0, sizeof request);
  strcpy(request.machine, "past-caller");
  request.channel = 1;
  parse_id(instance, request.assigned);
  draw(&request.epoch, sizeof request.epoch);
  strcpy(request.uuid, uuid);
  request.state = 1;
  for (int i = 0; i < count; ++i) {
    request.number = (uint64_t)i + 1;
    request.attempt = 1;
    request.text._buffer = (uint8_t*)texts[i];
    request.text._length = (uint32_t)strlen(texts[i]);
    request.seen = request.dispatched = dds_time();
    checked(dds_write(requests, &request), "write a request");
    await_reply(replies, &request, deadline);
  }
  request.attempt = 0;
  checked(dds_write(requests, &request), "cancel");
  checked(dds_dispose(requests, &request), "dispose");
  checked(dds_delete(participant), "leave");
  return 0;
}

int main(int argc, char** argv) {
  signal(SIGTERM, end);
  if (argc == 4 && strcmp(argv[1], "serve") == 0) {
    return serve((uint32_t)atoi(argv[2]), argv[3]);
  }
  if (argc > 4 && strcmp(argv[1], "call") == 0) {
    return call((uint32_t)atoi(argv[2]), argv[3], argv + 4, argc - 4);
  }
  fprintf(stderr, "usage: past_peer serve DOMAIN UUID | past_peer call DOMAIN UUID TEXT...\n");
  return 64;
}
