// The interface of inverse_dynamics_solver 1.0 to 6.0: the same functions, arguments and headers.
#pragma once
#include <eigen3/Eigen/Core>
#include <rclcpp/node_interfaces/node_parameters_interface.hpp>
#include <string>
#include <tuple>

namespace inverse_dynamics_solver
{
class InverseDynamicsSolver
{
public:
  using Vector = const Eigen::VectorXd &;
  virtual ~InverseDynamicsSolver() {}
  virtual void initialize(
    rclcpp::node_interfaces::NodeParametersInterface::ConstSharedPtr = nullptr,
    const std::string & = "", const std::string & = "") = 0;
  virtual std::tuple<Eigen::MatrixXd, Eigen::VectorXd, Eigen::VectorXd> getDynamicParameters(
    Vector q, Vector v) const
  {
    return {getInertiaMatrix(q), getCoriolisVector(q, v), getGravityVector(q)};
  }
  virtual Eigen::MatrixXd getInertiaMatrix(Vector q) const = 0;
  virtual Eigen::VectorXd getCoriolisVector(Vector q, Vector v) const = 0;
  virtual Eigen::VectorXd getGravityVector(Vector q) const = 0;
  virtual Eigen::VectorXd getFrictionVector(Vector v) const = 0;
  // The interface's own has no friction; a plug-in that knows better replaces it.
  virtual Eigen::VectorXd getTorques(Vector q, Vector v, Vector a) const = 0;

protected:
  InverseDynamicsSolver() {}
};
}  // namespace inverse_dynamics_solver
