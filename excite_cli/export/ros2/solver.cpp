// An identified model (model.c) as a plug-in of inverse_dynamics_solver. For positions q, velocities
// v and accelerations a of the joints in the model's order,
//
//     getTorques(q, v, a) = tau(q, v, a)         all of the model
//     getGravityVector(q) = tau(q, 0, 0) = g     all that holds the robot: also springs and offsets
//     getInertiaMatrix(q) = tau(q, 0, e_j) - g   column by column: also rotors
//     getFrictionVector(v) = f                   at position 0 of all joints, without load
//     getCoriolisVector(q, v) = tau(q, v, 0) - g - f
//
// so that inertia * a + Coriolis + gravity + friction is all torque of a state (of friction that grows
// with the load, what it is without acceleration). Every answer is NaN where something given is not
// finite: it must not be applied.
#include <stdexcept>
#include <string>

#include <inverse_dynamics_solver/inverse_dynamics_solver.hpp>
#include <pluginlib/class_list_macros.hpp>

extern "C" {
int excite_state(const double * q, const double * v, const double * a, double * tau);
int excite_friction(const double * q, const double * v, const double * load, double * tau);
}

namespace @NAME@_plugin
{
constexpr int N = @N@;

using Eigen::MatrixXd;
using Eigen::VectorXd;

class Solver : public inverse_dynamics_solver::InverseDynamicsSolver
{
public:
  void initialize(
    rclcpp::node_interfaces::NodeParametersInterface::ConstSharedPtr, const std::string &,
    const std::string &) override {}

  MatrixXd getInertiaMatrix(const VectorXd & q) const override
  {
    MatrixXd inertia(N, N);
    for (int j = 0; j < N; ++j) {
      inertia.col(j) = getTorques(q, zero_, VectorXd::Unit(N, j)) - getGravityVector(q);
    }
    return inertia;
  }

  VectorXd getCoriolisVector(const VectorXd & q, const VectorXd & v) const override
  {
    return getTorques(q, v, zero_) - getGravityVector(q) - getFrictionVector(v);
  }

  VectorXd getGravityVector(const VectorXd & q) const override
  {
    return getTorques(q, zero_, zero_);
  }

  VectorXd getFrictionVector(const VectorXd & v) const override
  {
    VectorXd tau(N);
    excite_friction(zero_.data(), checked(v), zero_.data(), tau.data());
    return tau;
  }

  VectorXd getTorques(const VectorXd & q, const VectorXd & v, const VectorXd & a) const override
  {
    VectorXd tau(N);
    excite_state(checked(q), checked(v), checked(a), tau.data());
    return tau;
  }

private:
  const VectorXd zero_ = VectorXd::Zero(N);

  static const double * checked(const VectorXd & x)
  {
    if (x.size() == N) {
      return x.data();
    }
    throw std::invalid_argument(
      "@NAME@: " + std::to_string(x.size()) + " joints are given. Give @N@, in this order: @JOINTS@.");
  }
};
}  // namespace @NAME@_plugin

PLUGINLIB_EXPORT_CLASS(@NAME@_plugin::Solver, inverse_dynamics_solver::InverseDynamicsSolver)
