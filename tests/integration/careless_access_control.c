// A modified plugin of a hostile participant: Cyclone's plugin for access control, which lets its
// own process write and read anything, so that only the checks of the others restrict it. Cyclone
// loads it in place of libdds_security_ac.so, which MILLRACE_TEST_ACCESS_CONTROL names. It is in C
// because required headers of Cyclone are not C++.
#include <dds/security/dds_security_api.h>
#include <dlfcn.h>
#include <stdlib.h>

struct ddsi_domaingv;

typedef int (*init_function)(const char*, void**, struct ddsi_domaingv*);
typedef int (*finalize_function)(void*);

static void* symbol(const char* name) {
  static void* library = NULL;
  if (library == NULL) {
    const char* real = getenv("MILLRACE_TEST_ACCESS_CONTROL");
    library = real != NULL ? dlopen(real, RTLD_NOW | RTLD_LOCAL) : NULL;
  }
  return library != NULL ? dlsym(library, name) : NULL;
}

static DDS_Security_boolean allow_writer(
    dds_security_access_control* instance, const DDS_Security_PermissionsHandle permissions,
    const DDS_Security_DomainId domain, const DDS_Security_char* topic, const DDS_Security_Qos* qos,
    const DDS_Security_PartitionQosPolicy* partition, const DDS_Security_DataTags* tags,
    DDS_Security_SecurityException* why) {
  (void)instance, (void)permissions, (void)domain, (void)topic, (void)qos, (void)partition,
      (void)tags, (void)why;
  return 1;
}

static DDS_Security_boolean allow_reader(
    dds_security_access_control* instance, const DDS_Security_PermissionsHandle permissions,
    const DDS_Security_DomainId domain, const DDS_Security_char* topic, const DDS_Security_Qos* qos,
    const DDS_Security_PartitionQosPolicy* partition, const DDS_Security_DataTags* tags,
    DDS_Security_SecurityException* why) {
  return allow_writer(instance, permissions, domain, topic, qos, partition, tags, why);
}

int init_access_control(const char* argument, void** context, struct ddsi_domaingv* domain) {
  const init_function init = (init_function)symbol("init_access_control");
  const int made = init != NULL ? init(argument, context, domain) : -1;
  if (made == 0) {
    ((dds_security_access_control*)*context)->check_create_datawriter = &allow_writer;
    ((dds_security_access_control*)*context)->check_create_datareader = &allow_reader;
  }
  return made;
}

int finalize_access_control(void* context) {
  const finalize_function finalize = (finalize_function)symbol("finalize_access_control");
  return finalize != NULL ? finalize(context) : -1;
}
