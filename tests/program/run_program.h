// Runs the program lazyccd in a process of its own, as a user does.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "io/file.h"
#include "support/temporary.h"

namespace lazyccd::test {

struct Outcome {
  int exit_code;
  std::string out, err;
};

inline std::string contents(const std::filesystem::path& path) {
  return std::filesystem::file_size(path) == 0 ? std::string() : io::read_file(path);
}

/// Runs lazyccd and waits for it. `arguments`: words and paths without quotes.
inline Outcome run(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string out = (folder / "stdout").string(), err = (folder / "stderr").string();
  const int status = std::system(
      ("'" LAZYCCD_PROGRAM "' " + arguments + " >'" + out + "' 2>'" + err + "'").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(out), contents(err)};
}

}  // namespace lazyccd::test
