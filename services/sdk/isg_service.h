/* clang-format off: it would join the lines of the examples */
/* The C interface of the controller vendor's service SDK, over millrace instead of ADS: a service
 * written for that SDK compiles unchanged and serves every machine of the fabric.
 *
 *   ISG_SERVICE_CODE squareRoot(ISG_SERVICE* service, char* request, ADS_UINT32 requestState,
 *                               char* response, size_t maxResponseSize,
 *                               ADS_UINT32* responseState) {
 *     ...
 *     return ISG_SERVICE_CODE_OK;
 *   }
 *
 *   ISG_SERVICE_CONNECTION connection;
 *   ISG_SERVICE service;
 *   if (isgServiceConnectionCreateADSLocal(552, 553, &connection) == ISG_SERVICE_CODE_OK &&
 *       isgServiceCreate("560AACBF-...", "Square root", squareRoot, &connection, &service) ==
 *           ISG_SERVICE_CODE_OK) {
 *     isgServicePoll(&service);
 *   }
 *
 * Documented are the names that the sample in the vendor's manual uses
 * (IB/tf5200_service_interface/356533387.html), and the form of its service function; no header is
 * public, so what they look like beyond their use there is inferred. What is marked "ours" has no
 * counterpart we know of.
 *
 * The fabric is chosen by the environment, because the vendor's functions have no argument for it
 * (ours):
 *   MILLRACE_FABRIC_CONFIG  file that describes the fabric, a fabric.textproto; the next two win
 *                           over it
 *   MILLRACE_DOMAIN         DDS domain, 0 to 232; default 0
 *   MILLRACE_FABRIC         name of the fabric; default millrace
 *   MILLRACE_CHANNELS       channels to serve, as MACHINE/N, separated by blanks; default all
 *   MILLRACE_DELIVERY       at-least-once (default) or at-most-once
 *   MILLRACE_COMPLETION_SIGNAL        what its NC programs wait for: response-state (default), or response:
 *                           a text in RESPONSE alone; then a state of 0 is an answer, too
 *   MILLRACE_LOG_LEVEL      error, warn, info (default), debug or trace
 */
/* clang-format on */
#ifndef MILLRACE_SERVICES_SDK_ISG_SERVICE_H
#define MILLRACE_SERVICES_SDK_ISG_SERVICE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Inferred: 32 bits, unsigned. */
typedef uint32_t ADS_UINT32;

/* Documented: the name of the type and of the first value. Ours: all other values. */
typedef int ISG_SERVICE_CODE;
#define ISG_SERVICE_CODE_OK 0
/* A null pointer, an empty UUID, a setting in the environment that makes no sense. */
#define ISG_SERVICE_CODE_INVALID_ARGUMENT 1
/* The fabric cannot be joined. */
#define ISG_SERVICE_CODE_NOT_CONNECTED 2
/* isgServicePollOnce: no call within the time. */
#define ISG_SERVICE_CODE_NO_CALL 3
/* The service has left the fabric, or was never created. */
#define ISG_SERVICE_CODE_CLOSED 4
/* Something that should not happen, as no memory left; standard error says what. */
#define ISG_SERVICE_CODE_FAILED 5

/* Where services connect to. Holds nothing that must be deleted. The members are ours. */
typedef struct ISG_SERVICE_CONNECTION {
  int sda_port;
  int com_port;
} ISG_SERVICE_CONNECTION;

/* One service. The member is ours. */
typedef struct ISG_SERVICE {
  struct millrace_isg_service* state;
} ISG_SERVICE;

/* The service function: reads `request`, at most 127 bytes in CP1252 and a NUL, writes `response`,
 * at most `maxResponseSize` (128) bytes with the NUL, and a `*responseState` other than 0 (see
 * MILLRACE_COMPLETION_SIGNAL above).
 *
 * Documented: the form with a code, whose parameters are not const, and which ends with
 * `return ISG_SERVICE_CODE_OK;` as the manual's sample does. Ours: what another code does (it
 * answers the call with an error state, 500), and a function that returns nothing. */
typedef ISG_SERVICE_CODE (*ISG_SERVICE_FUNCTION)(ISG_SERVICE* service, char* request,
                                                 ADS_UINT32 requestState, char* response,
                                                 size_t maxResponseSize, ADS_UINT32* responseState);
typedef void (*ISG_SERVICE_FUNCTION_VOID)(ISG_SERVICE* service, char* request,
                                          ADS_UINT32 requestState, char* response,
                                          size_t maxResponseSize, ADS_UINT32* responseState);

/* Documented. The ports (552 and 553, the controller's ADS ports) mean nothing on a fabric; they
 * are only logged. */
ISG_SERVICE_CODE isgServiceConnectionCreateADSLocal(int sdaPort, int comPort,
                                                    ISG_SERVICE_CONNECTION* connection);

/* Documented. Joins the fabric; what is wrong is written to standard error. Calls wait until the
 * service is polled. Ours: the plain name takes both forms of function, the two below take one. */
ISG_SERVICE_CODE isgServiceCreateVoid(const char* uuid, const char* description,
                                      ISG_SERVICE_FUNCTION_VOID function,
                                      const ISG_SERVICE_CONNECTION* connection,
                                      ISG_SERVICE* service);
ISG_SERVICE_CODE isgServiceCreateWithCode(const char* uuid, const char* description,
                                          ISG_SERVICE_FUNCTION function,
                                          const ISG_SERVICE_CONNECTION* connection,
                                          ISG_SERVICE* service);

/* Documented: runs the service function for one call after the other, for as long as the service
 * lives. Ours: isgServiceStop ends it with ISG_SERVICE_CODE_OK when the calls under way are
 * answered, and the service has left the fabric then. SIGTERM and SIGINT do the same, each unless
 * the program handled or ignored it before it created the service. */
ISG_SERVICE_CODE isgServicePoll(ISG_SERVICE* service);

/* Ours: runs the function for one call if one comes within `timeoutMs`; else
 * ISG_SERVICE_CODE_NO_CALL, or ISG_SERVICE_CODE_CLOSED once the service is stopped and has no call
 * under way. */
ISG_SERVICE_CODE isgServicePollOnce(ISG_SERVICE* service, unsigned timeoutMs);

/* Ours: asks for no new call; polling ends when the calls under way are answered. From any thread.
 */
ISG_SERVICE_CODE isgServiceStop(ISG_SERVICE* service);

/* Ours: leaves the fabric at once and frees the service. Not while it is polled. */
void isgServiceDelete(ISG_SERVICE* service);

/* Ours, for use within the service function: 1 if the program does not wait for the answer any
 * more. */
int isgServiceCancelled(const ISG_SERVICE* service);

/* Ours, for use within the service function: shows the program a text and a state before the
 * answer. SysServiceWait.cyc waits until RESPONSE_STATE is not @P1: the program waits with @P1=0
 * first, and then with @P1=state for as long as that is the state. */
ISG_SERVICE_CODE isgServiceInterim(ISG_SERVICE* service, const char* text, ADS_UINT32 state);

/* Ours: what a code means, in English. */
const char* isgServiceCodeText(ISG_SERVICE_CODE code);

/* The vendor's sample is written for a C library with sprintf_s (C11, Annex K). As there, a text
 * that does not fit leaves an empty string; the result is -1 then. */
#if !defined(_MSC_VER) && !defined(__STDC_LIB_EXT1__) && !defined(sprintf_s)
static inline int isg_sprintf_s(char* buffer, size_t size, const char* format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
static inline int isg_sprintf_s(char* buffer, size_t size, const char* format, ...) {
  va_list arguments;
  int length;
  va_start(arguments, format);
  length = vsnprintf(buffer, size, format, arguments);
  va_end(arguments);
  if (length < 0 || (size_t)length >= size) {
    if (size > 0) {
      buffer[0] = '\0';
    }
    return -1;
  }
  return length;
}
#define sprintf_s isg_sprintf_s
#endif

#ifdef __cplusplus
}

inline ISG_SERVICE_CODE isgServiceCreate(const char* uuid, const char* description,
                                         ISG_SERVICE_FUNCTION_VOID function,
                                         const ISG_SERVICE_CONNECTION* connection,
                                         ISG_SERVICE* service) {
  return isgServiceCreateVoid(uuid, description, function, connection, service);
}
inline ISG_SERVICE_CODE isgServiceCreate(const char* uuid, const char* description,
                                         ISG_SERVICE_FUNCTION function,
                                         const ISG_SERVICE_CONNECTION* connection,
                                         ISG_SERVICE* service) {
  return isgServiceCreateWithCode(uuid, description, function, connection, service);
}
#else
#define isgServiceCreate(uuid, description, function, connection, service) \
  _Generic((function),                                                     \
      ISG_SERVICE_FUNCTION: isgServiceCreateWithCode,                      \
      default: isgServiceCreateVoid)(uuid, description, function, connection, service)
#endif

#endif /* MILLRACE_SERVICES_SDK_ISG_SERVICE_H */
