// What --version prints of millrace.
#pragma once

#include <string>

namespace millrace::base::program {

/// The commit of the sources: twelve digits, and a + if the tree had changes that are in no commit.
/// Empty in sources that are no clone, and in tests: only programs are linked with their commit
/// (deploy/cmake/Commit.cmake).
const char* commit();

/// "0.1.0, commit 0123456789ab"; without a commit "0.1.0".
std::string version_and_commit();

}  // namespace millrace::base::program
