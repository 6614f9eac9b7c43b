// Loads a plug-in: `driver LIBRARY N q… v… a…` prints inertia matrix (row by row), Coriolis, gravity
// and friction vectors and torques, and what it says of a vector that is one entry short.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <inverse_dynamics_solver/inverse_dynamics_solver.hpp>
#include <stdexcept>

using inverse_dynamics_solver::InverseDynamicsSolver;

static void print(const Eigen::VectorXd & x)
{
  for (long i = 0; i < x.size(); ++i) {
    std::printf("%.17g\n", x(i));
  }
}

int main(int, char ** given)
{
  void * library = dlopen(given[1], RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    std::fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  auto make = reinterpret_cast<InverseDynamicsSolver * (*)()>(dlsym(library, "made"));
  InverseDynamicsSolver * solver = make();
  const long n = std::atol(given[2]);
  Eigen::VectorXd q(n), v(n), a(n);
  for (long i = 0; i < n; ++i) {
    q(i) = std::atof(given[3 + i]);
    v(i) = std::atof(given[3 + n + i]);
    a(i) = std::atof(given[3 + 2 * n + i]);
  }
  solver->initialize();
  const auto [inertia, coriolis, gravity] = solver->getDynamicParameters(q, v);
  for (long i = 0; i < n; ++i) {
    for (long j = 0; j < n; ++j) {
      std::printf("%.17g\n", inertia(i, j));
    }
  }
  print(coriolis);
  print(gravity);
  print(solver->getFrictionVector(v));
  print(solver->getTorques(q, v, a));
  try {
    solver->getGravityVector(Eigen::VectorXd::Zero(n - 1));
  } catch (const std::invalid_argument & error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  delete solver;
}
