// Strategy. The block has two mirror planes, x = 0 and y = 0. Every field is the sum of four parts, each even or odd
// across each plane (parity classes). Each part is determined by its values on a quarter of the block, where it obeys
// simple conditions on the mirror planes. For each class:
//
//   1. The quarter is divided into a few box-shaped elements of high degree. Their interiors, the same in every class,
//      are condensed once per shape (spectral_element).
//   2. The right-hand sides are the targets, not the loads: x = K^-1 R^T, where the rows R read the displacement at the
//      targets off the unknowns (frontal_solver). As K is symmetric, x^T f is the displacement at the targets under any
//      nodal load f. This is the operator `transfer` from boundary data (nodal loads on the sides, displacements on the
//      base) to the targets.
//   3. A source's boundary data is the half-space field on the sides and the base, evaluated at the four mirror images
//      of each point and averaged with the signs of the class. Mirror images of a source share this data.
//
// For fewer sources than targets, their boundary data are the right-hand sides instead.
#include "sensor/elastic/block.h"

#include "sensor/elastic/box_mesh.h"
#include "sensor/elastic/frontal_solver.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/linear_algebra.h"
#include "sensor/elastic/parallel.h"
#include "sensor/elastic/parity.h"
#include "sensor/elastic/quadrature.h"
#include "sensor/elastic/spectral_element.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <thread>

namespace sensor::elastic {
namespace {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector3d;

struct Element {
  std::size_t shape = 0;
  std::vector<int> unknowns;  // 3 x node + component, in the order of the shell's unknowns
  MatrixXd interpolation;     // unknowns x columns of the targets in this element
  Index firstColumn = 0;
};

// A boundary point at which the half-space field is evaluated.
struct Sample {
  Vector3d point;
  int normal;  // 0, 1: traction on the side facing along x, y; 2: displacement on the base
};

// A side face of an element, and how its samples contribute to the nodal loads.
struct Face {
  Index firstSample;
  std::vector<int> boundaryNodes;  // -1 on the base
  MatrixXd weights;                // nodes x samples [m^2]
};

// The boundary's nodes: first those of the base, with a sample at each, then those of the sides.
struct Boundary {
  std::vector<int> ofNode;  // per mesh node: its number on the boundary, or -1
  Index baseCount = 0;
  Index count = 0;
  std::vector<Sample> samples;
  std::vector<Face> faces;
};

using PerClass = std::array<MatrixXd, kClasses>;

// Chooses the element boundaries of the quarter block along x, y and the depth, from 0 to 1, as fractions of half the
// width, half the height and the thickness. The correction varies over lengths of about the thickness and is weakly
// singular where the base meets the sides: one small element lies at each side, the elements inside are not much longer
// than the thickness, and a block that is thick relative to its width also has a small element above the base.
std::array<std::vector<double>, 3> chooseBreaks(const Vector3d& size, double clearance) {
  constexpr double kGradedBelow = 8e-3;  // [m]
  constexpr double kEdge = 0.8;          // begin of the small elements
  constexpr double kLongest = 1.35;      // longest element, in thicknesses
  if (clearance < kGradedBelow) return {{{0.0, 0.5, 0.84, 1.0}, {0.0, 0.5, 0.84, 1.0}, {0.0, 0.2, 0.55, 1.0}}};
  std::array<std::vector<double>, 3> breaks;
  bool isThick = false;
  for (int d = 0; d < 2; ++d) {
    const int inside = std::max(1, static_cast<int>(std::ceil(kEdge * size[d] / (kLongest * size.z()))));
    for (int i = 0; i <= inside; ++i) breaks[d].push_back(kEdge * i / inside);
    breaks[d].push_back(1.0);
    isThick = isThick || inside == 1;
  }
  breaks[2] = isThick ? std::vector{0.0, kEdge, 1.0} : std::vector{0.0, 1.0};
  return breaks;
}

std::array<std::vector<double>, 3> planesOf(const Gel& gel, double clearance) {
  const Vector3d size(0.5 * gel.size.x(), 0.5 * gel.size.y(), gel.size.z());
  std::array<std::vector<double>, 3> planes = chooseBreaks(size, clearance);
  for (int d = 0; d < 3; ++d)
    for (double& plane : planes[d]) plane *= size[d];
  return planes;
}

Boundary makeBoundary(const BoxMesh& mesh) {
  Boundary boundary;
  boundary.ofNode.assign(static_cast<std::size_t>(mesh.nodeCount()), -1);
  for (int node = 0; node < mesh.nodeCount(); ++node)
    if (mesh.place(node)[2] == mesh.last(2)) {
      boundary.ofNode[node] = static_cast<int>(boundary.count++);
      boundary.samples.push_back({mesh.position(mesh.place(node)), 2});
    }
  boundary.baseCount = boundary.count;
  for (int node = 0; node < mesh.nodeCount(); ++node)
    if (boundary.ofNode[node] < 0 && (mesh.place(node)[0] == mesh.last(0) || mesh.place(node)[1] == mesh.last(1)))
      boundary.ofNode[node] = static_cast<int>(boundary.count++);

  const int degree = mesh.degree();
  const Rule rule = gauss(degree + 3);
  const MatrixXd values = lagrange(gaussLobatto(degree + 1).points, rule.points);
  const Index points = rule.points.size();
  for (int normal = 0; normal < 2; ++normal) {
    const int along = 1 - normal;
    Lattice cell{};
    cell[normal] = mesh.cells(normal) - 1;
    for (cell[2] = 0; cell[2] < mesh.cells(2); ++cell[2])
      for (cell[along] = 0; cell[along] < mesh.cells(along); ++cell[along]) {
        Face face{
            static_cast<Index>(boundary.samples.size()), {}, MatrixXd((degree + 1) * (degree + 1), points * points)};
        const Vector3d corner = mesh.corner(cell), size = mesh.size(cell);
        for (Index q = 0; q < points; ++q)
          for (Index p = 0; p < points; ++p) {
            Vector3d unit = Vector3d::Ones();
            unit[along] = 0.5 * (1.0 + rule.points[p]);
            unit[2] = 0.5 * (1.0 + rule.points[q]);
            boundary.samples.push_back({corner + unit.cwiseProduct(size), normal});
          }
        for (int k = 0; k <= degree; ++k)
          for (int i = 0; i <= degree; ++i) {
            Lattice place;
            place[normal] = mesh.last(normal);
            place[along] = cell[along] * degree + i;
            place[2] = cell[2] * degree + k;
            const auto row = static_cast<Index>(face.boundaryNodes.size());
            face.boundaryNodes.push_back(place[2] == mesh.last(2) ? -1 : boundary.ofNode[mesh.number(place)]);
            for (Index q = 0; q < points; ++q)
              for (Index p = 0; p < points; ++p)
                face.weights(row, q * points + p) =
                    0.25 * size[along] * size[2] * rule.weights[p] * values(p, i) * rule.weights[q] * values(q, k);
          }
        boundary.faces.push_back(std::move(face));
      }
  }
  return boundary;
}

// The elements in the order of the tree, with the targets inside them.
struct Elements {
  std::vector<MatrixXd> stiffnesses;  // one per shape
  std::map<Lattice, Element> at;
  Index columns = 0;
};

// `columns` receives the column of each component of each target.
Elements makeElements(const BoxMesh& mesh, const CellRange& whole, const Gel& gel, const Points& targets,
                      std::vector<std::array<Index, 3>>& columns) {
  std::map<Lattice, std::vector<Index>> targetsIn;
  for (Index t = 0; t < targets.cols(); ++t) targetsIn[mesh.cellAt(targets.col(t))].push_back(t);
  std::map<std::array<long long, 3>, std::vector<Lattice>> shapes;
  Elements elements;
  columns.resize(static_cast<std::size_t>(targets.cols()));
  for (const Lattice& cell : whole.cells()) {
    constexpr double kSame = 1e-9;  // [m]
    const Vector3d size = mesh.size(cell);
    shapes[{std::llround(size.x() / kSame), std::llround(size.y() / kSame), std::llround(size.z() / kSame)}].push_back(
        cell);
    const std::vector<Index>& inside = targetsIn[cell];
    Element& element = elements.at[cell];
    element.firstColumn = elements.columns;
    for (std::size_t i = 0; i < inside.size(); ++i)
      for (int c = 0; c < 3; ++c) columns[inside[i]][c] = elements.columns + static_cast<Index>(c * inside.size() + i);
    elements.columns += static_cast<Index>(3 * inside.size());
    for (const Lattice& place : shellNodes(mesh.degree())) {
      const int node = mesh.number(
          {cell[0] * mesh.degree() + place[0], cell[1] * mesh.degree() + place[1], cell[2] * mesh.degree() + place[2]});
      for (int c = 0; c < 3; ++c) element.unknowns.push_back(3 * node + c);
    }
  }
  for (const auto& [key, cells] : shapes) {
    CondensedElement condensed =
        condensedElement(mesh.degree(), mesh.size(cells.front()), gel.youngsModulus, gel.poissonRatio);
    for (const Lattice& cell : cells) {
      const std::vector<Index>& inside = targetsIn[cell];
      const Points unit =
          (targets(Eigen::all, inside).colwise() - mesh.corner(cell)).array().colwise() / mesh.size(cell).array();
      elements.at[cell].shape = elements.stiffnesses.size();
      elements.at[cell].interpolation = condensed.interpolation(unit);
    }
    elements.stiffnesses.push_back(std::move(condensed.stiffness));
  }
  return elements;
}

// Solves one class on the quarter block.
class ClassSolver {
 public:
  ClassSolver(unsigned parity, const BoxMesh& mesh, const CellRange& whole, const Elements& elements,
              const Boundary& boundary)
      : parity_(parity)
      , mesh_(mesh)
      , whole_(whole)
      , elements_(elements)
      , boundary_(boundary)
      , solver_(3 * mesh.nodeCount()) {}

  // Returns the transfer operator, 3 boundary nodes x columns.
  MatrixXd transfer() {
    assemble(whole_, nullptr);
    const MatrixXd x = solver_.solve(elements_.columns);
    MatrixXd result = MatrixXd::Zero(3 * boundary_.count, elements_.columns);
    for (std::size_t node = 0; node < boundary_.ofNode.size(); ++node)
      if (boundary_.ofNode[node] >= boundary_.baseCount)
        result.middleRows<3>(3 * boundary_.ofNode[node]) = x.middleRows<3>(3 * static_cast<Index>(node));
    for (const auto& [cell, element] : elements_.at) {
      if (cell[2] != mesh_.cells(2) - 1) continue;
      const Split split = splitUnknowns(element);
      std::vector<int> rows, free;
      for (const int i : split.base) rows.push_back(static_cast<int>(boundaryRow(element, i)));
      for (const int i : split.free) free.push_back(element.unknowns[i]);
      MatrixXd reaction(static_cast<Index>(rows.size()), elements_.columns);
      const MatrixXd atFree = x(free, Eigen::all);
      multiply(-1.0, stiffness(element, split.base, split.free), Op::kPlain, atFree, Op::kPlain, 0.0, reaction);
      reaction.middleCols(element.firstColumn, element.interpolation.cols()) +=
          element.interpolation(split.base, Eigen::all);
      result(rows, Eigen::all) += reaction;
    }
    return result;
  }

  // Returns the displacements at the targets by boundary data: what transfer()^T * data is.
  MatrixXd respond(const MatrixXd& data) {
    std::vector<bool> isLoaded(static_cast<std::size_t>(mesh_.nodeCount()));
    Load load{data, isLoaded};
    assemble(whole_, &load);
    MatrixXd x = solver_.solve(data.cols());
    MatrixXd result(elements_.columns, data.cols());
    for (const auto& [cell, element] : elements_.at) {
      for (const int i : splitUnknowns(element).base) x.row(element.unknowns[i]) = data.row(boundaryRow(element, i));
      const MatrixXd shell = x(element.unknowns, Eigen::all);
      multiply(1.0, element.interpolation, Op::kTransposed, shell, Op::kPlain, 0.0,
               result.middleRows(element.firstColumn, element.interpolation.cols()));
    }
    return result;
  }

 private:
  // Rows of an element's shell: free unknowns, and those prescribed on the base. Unknowns that vanish in the class are
  // in neither.
  struct Split {
    std::vector<int> free, base;
  };

  // Boundary data as right-hand sides; the load of a node counts in the first of its elements.
  struct Load {
    const MatrixXd& data;
    std::vector<bool>& isLoaded;  // of each node
  };

  Index boundaryRow(const Element& element, int i) const {
    return 3 * boundary_.ofNode[element.unknowns[i] / 3] + element.unknowns[i] % 3;
  }

  MatrixXd stiffness(const Element& element, const std::vector<int>& rows, const std::vector<int>& columns) const {
    return elements_.stiffnesses[element.shape](rows, columns);
  }

  // Returns an element's right-hand sides, of its free unknowns.
  MatrixXd rightOf(const Element& element, const Split& split, Load& load) const {
    MatrixXd base(static_cast<Index>(split.base.size()), load.data.cols());
    MatrixXd right = MatrixXd::Zero(static_cast<Index>(split.free.size()), load.data.cols());
    for (Index i = 0; i < base.rows(); ++i) base.row(i) = load.data.row(boundaryRow(element, split.base[i]));
    multiply(-1.0, stiffness(element, split.free, split.base), Op::kPlain, base, Op::kPlain, 0.0, right);
    for (Index i = 0; i < right.rows(); ++i) {
      const int node = element.unknowns[split.free[i]] / 3;
      if (boundary_.ofNode[node] >= 0 && !load.isLoaded[node])
        right.row(i) += load.data.row(boundaryRow(element, split.free[i]));
    }
    for (const int unknown : element.unknowns) load.isLoaded[unknown / 3] = true;
    return right;
  }

  Split splitUnknowns(const Element& element) const {
    Split split;
    for (std::size_t i = 0; i < element.unknowns.size(); ++i) {
      const Lattice& place = mesh_.place(element.unknowns[i] / 3);
      const int component = element.unknowns[i] % 3;
      if ((place[0] == 0 && vanishes(parity_, 0, component)) || (place[1] == 0 && vanishes(parity_, 1, component)))
        continue;
      (place[2] == mesh_.last(2) ? split.base : split.free).push_back(static_cast<int>(i));
    }
    return split;
  }

  // `load`: null for the targets as right-hand sides.
  Front assemble(const CellRange& range, Load* load) {
    std::vector<Front> parts;
    if (range.isCell()) {
      const Element& element = elements_.at.at(range.first);
      const Split split = splitUnknowns(element);
      const std::vector<int>& free = split.free;
      Front front{{}, stiffness(element, free, free), {}, 0};
      if (load != nullptr) {
        front.right = rightOf(element, split, *load);
      } else {
        front.right = element.interpolation(free, Eigen::all);
        front.firstColumn = element.firstColumn;
      }
      for (const int i : free) front.unknowns.push_back(element.unknowns[i]);
      parts.push_back(std::move(front));
    } else {
      const auto [a, b] = range.halves();
      parts.push_back(assemble(a, load));
      parts.push_back(assemble(b, load));
    }
    return solver_.eliminate(parts, [&](int unknown) { return range.owns(mesh_, mesh_.place(unknown / 3)); });
  }

  unsigned parity_;
  const BoxMesh& mesh_;
  CellRange whole_;
  const Elements& elements_;
  const Boundary& boundary_;
  FrontalSolver solver_;
};

}  // namespace

struct BlockCorrection::Data {
  double youngsModulus, poissonRatio;
  Folded targets;
  BoxMesh mesh;
  CellRange whole;
  std::vector<std::array<Index, 3>> columns;  // columns of `transfer` for each component at each distinct target
  Boundary boundary;
  Elements elements;  // without a transfer
  PerClass transfer;  // 3 boundary nodes x 3 distinct targets; w at the targets is transfer^T * boundary data

  Data(const Gel& gel, const Points& points, const BlockOptions& options, const Progress& progress);

  // Returns w at the distinct targets: a column per unit force at each source.
  PerClass respond(const Points& sources) const;

 private:
  ClassSolver solver(unsigned parity) const { return {parity, mesh, whole, elements, boundary}; }
  MatrixXd compress(MatrixXd& data) const;
  PerClass boundaryData(const Points& sources) const;
};

BlockCorrection::Data::Data(const Gel& gel, const Points& points, const BlockOptions& options, const Progress& progress)
    : youngsModulus(gel.youngsModulus)
    , poissonRatio(gel.poissonRatio)
    , targets(fold(points))
    , mesh(options.degree, planesOf(gel, options.clearance))
    , whole{{0, 0, 0}, {mesh.cells(0) - 1, mesh.cells(1) - 1, mesh.cells(2) - 1}}
    , boundary(makeBoundary(mesh))
    , elements(makeElements(mesh, whole, gel, targets.distinct, columns)) {
  if (!options.solveForSources) {
    std::atomic<int> begun = 0;
    inParallel(kClasses, [&, caller = std::this_thread::get_id()](Index parity) {
      const double done = ++begun / (kClasses + 1.0);
      if (progress && std::this_thread::get_id() == caller) progress(done);
      transfer[parity] = solver(static_cast<unsigned>(parity)).transfer();
    });
    elements = {};
  }
  if (progress) progress(1.0);
}

// Returns minus the half-space field of the sources: displacements of the base's nodes, then loads on the sides' nodes.
PerClass BlockCorrection::Data::boundaryData(const Points& sources) const {
  const Index width = 3 * sources.cols();
  const auto count = static_cast<Index>(boundary.samples.size());
  PerClass sampled;  // samples x (component * width + column)
  sampled.fill(MatrixXd::Zero(count, 3 * width));
  inParallel(sources.cols(), [&](Index s) {
    for (Index i = 0; i < count; ++i) {
      const Sample& sample = boundary.samples[i];
      std::array<Matrix3d, kClasses> images;
      for (unsigned image = 0; image < kClasses; ++image) {
        const Vector3d sign = mirror(image);
        const Vector3d offset = sign.cwiseProduct(sample.point) - sources.col(s);
        Matrix3d value;
        if (sample.normal == 2) {
          value = halfSpaceDisplacement(offset, youngsModulus, poissonRatio);
        } else {
          const auto stress = halfSpaceStress(offset, poissonRatio);
          for (int j = 0; j < 3; ++j) value.col(j) = sign[sample.normal] * stress[j].col(sample.normal);
        }
        images[image] = -0.25 * sign.asDiagonal() * value;
      }
      for (unsigned parity = 0; parity < kClasses; ++parity) {
        Matrix3d mean = images[0];
        for (unsigned image = 1; image < kClasses; ++image) mean += character(parity, image) * images[image];
        for (int c = 0; c < 3; ++c)
          for (int j = 0; j < 3; ++j) sampled[parity](i, c * width + 3 * s + j) = mean(c, j);
      }
    }
  });

  PerClass data;
  inParallel(kClasses, [&](Index parity) {
    data[parity] = MatrixXd::Zero(3 * boundary.count, width);
    for (Index node = 0; node < boundary.baseCount; ++node)
      for (int c = 0; c < 3; ++c) data[parity].row(3 * node + c) = sampled[parity].row(node).segment(c * width, width);
    for (const Face& face : boundary.faces) {
      MatrixXd loads(face.weights.rows(), 3 * width);
      multiply(1.0, face.weights, Op::kPlain, sampled[parity].middleRows(face.firstSample, face.weights.cols()),
               Op::kPlain, 0.0, loads);
      for (Index node = 0; node < loads.rows(); ++node)
        for (int c = 0; c < 3 && face.boundaryNodes[node] >= 0; ++c)
          data[parity].row(3 * face.boundaryNodes[node] + c) += loads.row(node).segment(c * width, width);
    }
  });
  return data;
}

// Replaces boundary data by fewer columns of which they are combinations; returns the shares of these. Sources side by
// side have nearly the same data: of 588 columns of the paper's gel some 250 are left.
MatrixXd BlockCorrection::Data::compress(MatrixXd& data) const {
  // Of the largest column. The influence differs by 3e-7 of its largest element; with a smaller share rounding makes it
  // more, and with 1e-6 it is 5e-6.
  constexpr double kNegligible = 1e-7;
  MatrixXd scaled = data, factor(data.cols(), data.cols());
  scaled.topRows(3 * boundary.baseCount) *= youngsModulus * mesh.size({0, 0, 0}).z();  // displacements, as forces
  multiplyBySelf(1.0, scaled, Op::kTransposed, 0.0, factor);
  const double largest = factor.diagonal().maxCoeff();
  Eigen::VectorXi pivots;
  const Index rank = factorisePivoted(kNegligible * kNegligible * largest, factor, pivots);
  data = data(Eigen::all, pivots.head(rank)).eval();
  solveLowerRight(factor.topLeftCorner(rank, rank), Op::kTransposed, data);
  MatrixXd shares = MatrixXd::Zero(rank, factor.cols());
  for (Index i = 0; i < factor.cols(); ++i) {
    const Index count = std::min(i + 1, rank);
    shares.col(pivots[i]).head(count) = factor.row(i).head(count);
  }
  return shares;
}

PerClass BlockCorrection::Data::respond(const Points& sources) const {
  PerClass data = boundaryData(sources);
  PerClass response;
  inParallel(kClasses, [&](Index parity) {
    if (!elements.at.empty()) {
      const MatrixXd shares = compress(data[parity]);
      const MatrixXd few = solver(static_cast<unsigned>(parity)).respond(data[parity]);
      response[parity].resize(few.rows(), shares.cols());
      multiply(1.0, few, Op::kPlain, shares, Op::kPlain, 0.0, response[parity]);
    } else {
      response[parity].resize(transfer[parity].cols(), data[parity].cols());
      multiply(1.0, transfer[parity], Op::kTransposed, data[parity], Op::kPlain, 0.0, response[parity]);
    }
  });
  return response;
}

BlockCorrection::BlockCorrection(const Gel& gel, const Points& targets, const BlockOptions& options,
                                 const Progress& progress)
    : data_(std::make_shared<const Data>(gel, targets, options, progress)) {}

MatrixXd BlockCorrection::matrix(const Points& sources) const {
  const Folded folded = fold(sources);
  const PerClass response = data_->respond(folded.distinct);
  const Folded& targets = data_->targets;
  MatrixXd result(3 * static_cast<Index>(targets.index.size()), 3 * sources.cols());
  inParallel(sources.cols(), [&](Index s) {
    result.middleCols<3>(3 * s).setZero();
    for (unsigned parity = 0; parity < kClasses; ++parity)
      for (int j = 0; j < 3; ++j) {
        const double signOfForce = character(parity, folded.image[s]) * mirror(folded.image[s])[j];
        const double* from = response[parity].col(3 * folded.index[s] + j).data();
        double* to = result.col(3 * s + j).data();
        for (std::size_t t = 0; t < targets.index.size(); ++t) {
          const double sign = signOfForce * character(parity, targets.image[t]);
          const Vector3d flip = mirror(targets.image[t]);
          for (int c = 0; c < 3; ++c) *to++ += sign * flip[c] * from[data_->columns[targets.index[t]][c]];
        }
      }
  });
  return result;
}

double clearanceOf(const Gel& gel, const Points& sources) {
  double clearance = BlockOptions{}.clearance;
  for (int d = 0; d < 2; ++d) clearance = std::min(clearance, 0.5 * gel.size[d] - sources.row(d).cwiseAbs().maxCoeff());
  return clearance;
}

MatrixXd blockDisplacement(const Gel& gel, const Points& targets, const Points& sources, int degree,
                           const Progress& progress) {
  const BlockOptions options{degree, clearanceOf(gel, sources), sources.cols() < targets.cols()};
  MatrixXd u = BlockCorrection(gel, targets, options, progress).matrix(sources);
  inParallel(sources.cols(), [&](Index s) {
    for (Index t = 0; t < targets.cols(); ++t)
      u.block<3, 3>(3 * t, 3 * s) +=
          halfSpaceDisplacement(targets.col(t) - sources.col(s), gel.youngsModulus, gel.poissonRatio);
  });
  return u;
}

}  // namespace sensor::elastic
