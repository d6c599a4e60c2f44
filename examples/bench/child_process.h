// Runs a function in a child process, so that a crash ends that process only.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <optional>
#include <stdexcept>
#include <type_traits>

namespace lazyccd::bench {

/// Returns what the function returns, copied byte by byte; nothing if the child crashes or the
/// function throws. Throws std::runtime_error if there can be no child. The child has none of the
/// caller's other threads.
template <class Function>
auto run_in_child(const Function& function) {
  using Result = std::decay_t<decltype(function())>;
  static_assert(std::is_trivially_copyable_v<Result>);
  std::fflush(nullptr);  // otherwise the child would print what is pending, too
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("cannot open a pipe");
  const pid_t child = fork();
  if (child == 0) {
    try {
      const Result result = function();
      _exit(write(ends[1], &result, sizeof result) == sizeof result ? 0 : 1);
    } catch (...) {
      _exit(1);
    }
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw std::runtime_error("cannot start a process");
  }
  Result result;
  const bool is_read = read(ends[0], &result, sizeof result) == sizeof result;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return is_read ? std::optional<Result>(result) : std::nullopt;
}

}  // namespace lazyccd::bench
