#include "bench/bullet/process.h"

#include <csignal>
#include <cstdio>
#include <stdexcept>

#include <fcntl.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/bullet/protocol.h"

namespace lazyccd::bench {

// The child process and the pipes to it.
struct BulletProcess::Pipes {
  pid_t child = -1;
  std::FILE* to = nullptr;
  std::FILE* from = nullptr;

  ~Pipes() {
    if (to) std::fclose(to);  // the child exits at the end of its input
    if (from) std::fclose(from);
    if (child > 0) waitpid(child, nullptr, 0);
  }

  void start(const char* program) {
    int down[2], up[2];
    // Close-on-exec: otherwise a second child would keep the input of the first one open.
    if (pipe2(down, O_CLOEXEC) || pipe2(up, O_CLOEXEC)) throw std::runtime_error("pipe failed");
    child = fork();
    if (child == 0) {
      dup2(down[0], STDIN_FILENO);
      dup2(up[1], STDOUT_FILENO);
      execl(program, program, static_cast<char*>(nullptr));
      _exit(127);
    }
    close(down[0]);
    close(up[1]);
    if (child < 0) throw std::runtime_error("fork failed");
    to = fdopen(down[1], "wb");
    from = fdopen(up[0], "rb");
    std::signal(SIGPIPE, SIG_IGN);  // a dead child then makes reads and writes fail
  }

  template <class T>
  void write(const T* data, std::size_t count) {
    if (std::fwrite(data, sizeof(T), count, to) != count) fail();
  }

  template <class T>
  void read(T* data, std::size_t count) {
    if (std::fflush(to) || std::fread(data, sizeof(T), count, from) != count) fail();
  }

  [[noreturn]] static void fail() {
    throw std::runtime_error("the program that runs Bullet's own detection ended too early");
  }
};

BulletProcess::BulletProcess(BulletPrecision precision) : pipes_(std::make_unique<Pipes>()) {
  pipes_->start(precision == BulletPrecision::double_precision ? LAZYCCD_BULLET_CCD_DOUBLE
                                                               : LAZYCCD_BULLET_CCD_FLOAT);
}

BulletProcess::~BulletProcess() = default;

void BulletProcess::set_mesh(const Positions& start, const Positions& end, Span<const Face> faces) {
  const Request request = Request::mesh;
  const std::int32_t counts[2] = {std::int32_t(start.count()), std::int32_t(faces.size())};
  pipes_->write(&request, 1);
  pipes_->write(counts, 2);
  for (const Positions* positions : {&start, &end})
    for (std::size_t i = 0; i < positions->count(); ++i) pipes_->write((*positions)[i].data(), 3);
  pipes_->write(faces.data(), faces.size());
}

double BulletProcess::pass() {
  const Request request = Request::pass;
  pipes_->write(&request, 1);
  double milliseconds;
  pipes_->read(&milliseconds, 1);
  return milliseconds;
}

std::vector<std::array<std::int32_t, 2>> BulletProcess::contacts() {
  const Request request = Request::contacts;
  pipes_->write(&request, 1);
  std::int32_t count;
  pipes_->read(&count, 1);
  std::vector<std::array<std::int32_t, 2>> pairs(static_cast<std::size_t>(count));
  pipes_->read(pairs.data(), pairs.size());
  return pairs;
}

double BulletProcess::queries(Span<const QueryPoints> queries, std::vector<std::uint8_t>& hits) {
  const Request request = Request::queries;
  const auto count = std::int32_t(queries.size());
  pipes_->write(&request, 1);
  pipes_->write(&count, 1);
  pipes_->write(queries.data(), queries.size());
  double nanoseconds;
  pipes_->read(&nanoseconds, 1);
  hits.resize(queries.size());
  pipes_->read(hits.data(), hits.size());
  return nanoseconds;
}

}  // namespace lazyccd::bench
