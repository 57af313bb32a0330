// millrace-archiver query and millrace-archiver export: the archive as text.
#pragma once

namespace millrace::services::archiver {

/// `query` shows rows to a person, `export` writes all of them for a program; the command line is
/// `argv` without the word. Both work while an archiver writes. Return an exit code.
int query(int argc, char** argv);
int export_rows(int argc, char** argv);

}  // namespace millrace::services::archiver
