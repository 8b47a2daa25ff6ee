// Continuous loads, off the node grid and integrated apart from it, through the mechanics and back through the solver.
// The same mechanics both ways: this tests the solver, not the truth of the mechanics.
#include "daemon/solve/model_solver.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <random>
#include <string>

namespace tractiond::solve::recovery_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using sensor::elastic::PatchQuadrature;

constexpr double kForce = 4.0;  // [N]

/// The loads and all points at which they act, each once.
class Loads {
 public:
  struct Load {
    std::string name;
    PatchQuadrature patch;
    Eigen::Index firstSource = 0;  ///< of as many as the patch has points
  };

  /// In the middle, off the centre and in a corner of the marker field; pressing, shearing and both; and a twist.
  Loads() {
    for (const Vector2d& at : {Vector2d(0.7e-3, 0.4e-3), Vector2d(20e-3, -15e-3), Vector2d(-28e-3, 25e-3)}) {
      const std::string place = " at " + std::to_string(1e3 * at.x()) + " " + std::to_string(1e3 * at.y()) + " mm";
      for (const Vector3d& force :
           {Vector3d(0.0, 0.0, kForce), Vector3d(kForce, 0.0, 0.0), Vector3d(0.0, -0.5 * kForce, 0.866 * kForce)}) {
        add("point" + place, {Vector3d(at.x(), at.y(), 0.0), force});
        add("Hertz" + place, sensor::elastic::hertz(at, 2.5e-3, force));
      }
      add("disc" + place, sensor::elastic::disc(at, 5e-3, Vector3d(0.0, 0.0, kForce)));
      add("twist" + place, sensor::elastic::twist(at, 5e-3, 5e-3));
    }
  }

  const std::vector<Load>& all() const { return all_; }
  const sensor::Points& sources() const { return sources_; }

 private:
  void add(const std::string& name, const PatchQuadrature& patch) {
    for (const Load& load : all_) {
      if (load.patch.points.cols() != patch.points.cols() || load.patch.points != patch.points) continue;
      all_.push_back({name, patch, load.firstSource});
      return;
    }
    all_.push_back({name, patch, sources_.cols()});
    sources_.conservativeResize(3, sources_.cols() + patch.points.cols());
    sources_.rightCols(patch.points.cols()) = patch.points;
  }

  std::vector<Load> all_;
  sensor::Points sources_;
};

/// By the mechanics of the block, 2M x 3S [px/N].
Eigen::MatrixXd image(const sensor::Sensor& sensor, const sensor::Points& sources) {
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  const sensor::Projection projection(sensor.camera, sensor.gel.size.z());
  const Eigen::MatrixXd displacement = sensor::elastic::blockDisplacement(sensor.gel, markers, sources);
  Eigen::MatrixXd result(2 * markers.cols(), displacement.cols());
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    result.middleRows<2>(2 * m) = projection.jacobian(markers.col(m)) * displacement.middleRows<3>(3 * m);
  }
  return result;
}

void expectLoadsBack(FieldSolver& solver, const sensor::Sensor& sensor, const Loads& loads,
                     const Eigen::MatrixXd& pixels) {
  TractionField field;
  field.resize(sensor.markerCount(), sensor.nodes.count());
  std::mt19937 random(1);
  std::uniform_int_distribution<int> anyMarker(0, sensor.markerCount() - 1);
  for (const Loads::Load& load : loads.all()) {
    const PatchQuadrature& patch = load.patch;
    Vector3d resultant = Vector3d::Zero(), moment = Vector3d::Zero(), centre = Vector3d::Zero();
    for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
      resultant += patch.forces.col(i);
      moment += Vector3d(patch.points.col(i)).cross(Vector3d(patch.forces.col(i)));
      centre += patch.points.col(i) / static_cast<double>(patch.points.cols());
    }
    MarkerField markers = fieldOf(pixels.middleCols(3 * load.firstSource, patch.forces.size()) *
                                  VectorXd::Map(patch.forces.data(), patch.forces.size()));
    for (const int missing : {0, 115}) {
      SCOPED_TRACE(load.name + ", markers missing: " + std::to_string(missing));
      while (markers.validCount > sensor.markerCount() - missing) loseMarker(markers, anyMarker(random));
      solver.solve(markers, field);
      ASSERT_TRUE(field.valid);
      EXPECT_LT((Vector3d::Map(field.resultant_N.data()) - resultant).norm(), 0.01 * kForce);
      EXPECT_LT((Vector3d::Map(field.moment_Nm.data()) - moment).norm(), 5e-4 + 0.025 * moment.norm());
      EXPECT_LT(field.residual_px, 0.01);
      EXPECT_EQ(field.centreOfPressureValid, resultant.z() > 1.0);
      if (!field.centreOfPressureValid) continue;
      EXPECT_LT((Vector2d::Map(field.centreOfPressure_m.data()) - centre.head<2>()).norm(), 0.5e-3);
    }
  }
}

/// Of the points, then of the loads, 2M x 3S: at once, as the block's preparation takes the time.
Eigen::MatrixXd imageOf(const sensor::Sensor& sensor, const sensor::Points& points, const Loads& loads) {
  sensor::Points sources(3, points.cols() + loads.sources().cols());
  sources << points, loads.sources();
  return image(sensor, sources);
}

TEST(Recovery, LoadsComeBackWithinOnePercent) {
  const sensor::Sensor sensor;
  const Loads loads;
  const Atoms atoms = makeAtoms(sensor);
  const Eigen::MatrixXd everything = imageOf(sensor, atoms.points, loads);
  const Factors factors = computeFactors(everything.leftCols(3 * atoms.points.cols()), atoms, still(everything.rows()),
                                         sensor.gel.youngsModulus * square(sensor.nodes.pitch), modelOptions({}))
                              .value();
  ModelSolver solver(factors, atoms, sensor);
  expectLoadsBack(solver, sensor, loads, everything.rightCols(3 * loads.sources().cols()));
}

}  // namespace
}  // namespace tractiond::solve::recovery_test
