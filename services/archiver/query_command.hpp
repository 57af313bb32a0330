// millrace-archiver query and millrace-archiver export: the archive as text.
#pragma once

namespace millrace::services::archiver {

/// `query` shows rows to a person, `export` writes all of them for another program. `argv` is the
/// command line without the command's name. Both work while an archiver writes. Return an exit
/// code.
int query(int argc, char** argv);
int export_rows(int argc, char** argv);

}  // namespace millrace::services::archiver
