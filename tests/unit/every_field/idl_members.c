// A generator for idlc: one line for each member of a struct, with its bound (0 = none), and for each named value of a code,
// a constant in a module of its own.
//
//   idlc -l libidl_members.so millrace.idl   →   MEMBER(millrace_Request, machine, 63)
//                                                ENUMERATOR(millrace_reply_kind, interim)
#include <idl/processor.h>
#include <idl/tree.h>
#include <idl/visit.h>
#include <idlc/generator.h>
#include <stdio.h>
#include <string.h>

static idl_retcode_t on_struct(const idl_pstate_t* state, bool revisit, const idl_path_t* path,
                               const void* node, void* out) {
  (void)state;
  (void)revisit;
  (void)path;
  const idl_struct_t* type = node;
  const idl_member_t* member;
  IDL_FOREACH(member, type->members) {
    const idl_declarator_t* name;
    const idl_type_spec_t* of = idl_strip(member->type_spec, IDL_STRIP_ALIASES);
    const bool is_bounded = (idl_is_sequence(of) || idl_is_string(of)) && idl_is_bounded(of);
    IDL_FOREACH(name, member->declarators) {
      fprintf(out, "MEMBER(millrace_%s, %s, %u)\n", idl_identifier(type), idl_identifier(name),
              is_bounded ? idl_bound(of) : 0u);
    }
  }
  return IDL_RETCODE_OK;
}

static idl_retcode_t on_constant(const idl_pstate_t* state, bool revisit, const idl_path_t* path,
                                 const void* node, void* out) {
  (void)state;
  (void)revisit;
  (void)path;
  const char* module = idl_identifier(idl_parent(node));
  if (strcmp(module, "millrace") != 0) {
    fprintf(out, "ENUMERATOR(millrace_%s, %s)\n", module, idl_identifier(node));
  }
  return IDL_RETCODE_OK;
}

idl_retcode_t generate(const idl_pstate_t* state, const idlc_generator_config_t* config);
idl_retcode_t generate(const idl_pstate_t* state, const idlc_generator_config_t* config) {
  (void)config;
  const char* sources[] = {state->sources->path->name, NULL};
  idl_visitor_t visitor = {0};
  visitor.visit = IDL_STRUCT | IDL_CONST;
  visitor.accept[IDL_ACCEPT_STRUCT] = &on_struct;
  visitor.accept[IDL_ACCEPT_CONST] = &on_constant;
  visitor.sources = sources;
  return idl_visit(state, state->root, &visitor, stdout);
}
