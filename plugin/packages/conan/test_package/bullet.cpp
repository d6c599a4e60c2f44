// Makes the solver, and says which backend it has.
#include <lazyccd/bullet/soft_body_solver.h>

#include <cstdio>

int main() {
  lazyccd::bullet::btLazySoftBodySolver solver;
  std::printf("%s\n", solver.status().c_str());
  return 0;
}
