// The version of millrace, and what --version prints of it.
#pragma once

#include <string>

namespace millrace::base::program {

/// As in Semantic Versioning: "1.0.0-rc.1".
const char* version();

/// The commit of the sources: twelve digits, and a + if the tree had changes that are in no commit.
/// Empty in sources that are no clone, and in tests: only programs are linked with their commit
/// (deploy/cmake/Commit.cmake).
const char* commit();

/// "1.0.0-rc.1, commit 0123456789ab"; without a commit "1.0.0-rc.1".
std::string version_and_commit();

}  // namespace millrace::base::program
