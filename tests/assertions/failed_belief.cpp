#include "assertions/failed_belief.h"

#include <stdexcept>

#include "lazyccd/debug/assert.h"

#if !defined(_WIN32)
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#endif

namespace lazyccd::test {

#if defined(_WIN32)
std::string failed_belief(const std::function<void()>&) {
  throw std::logic_error("failed_belief() needs fork()");
}
#else
namespace {

int told = -1;  // where the child process tells what was believed

bool tell(const FailedAssertion& failed) {
  const bool written = write(told, failed.belief, std::strlen(failed.belief)) >= 0;
  _exit(written ? 0 : 1);
}

}  // namespace

std::string failed_belief(const std::function<void()>& code) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe to the child process");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process");
  if (child == 0) {
    told = ends[1];
    set_assert_handler(tell);
    try {
      code();
    } catch (...) {
      _exit(2);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string belief;
  char text[256];
  for (ssize_t count; (count = read(ends[0], text, sizeof text)) > 0;)
    belief.append(text, static_cast<std::size_t>(count));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("the child process failed, and no assertion did");
  return belief;
}
#endif

}  // namespace lazyccd::test
