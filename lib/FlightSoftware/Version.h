/// Which software this is, for the log.
#pragma once

namespace strix {

constexpr const char* kVersion = "0.1.0";

/// Commit it was built from; a build that knows it defines STRIX_GIT_COMMIT.
#ifdef STRIX_GIT_COMMIT
constexpr const char* kGitCommit = STRIX_GIT_COMMIT;
#else
constexpr const char* kGitCommit = "";
#endif

}  // namespace strix
