// The model of contacts that the daemon does not use yet (daemon/solve/model.h), on displacements from elsewhere.
//
// usage: evaluation_model JOB GEL NOISE field|patches [FAINTEST]    reads JOB/moved_px.f64 (frames x markers x 2) of
// noise NOISE [px]; writes, a row a frame, JOB/wrench.f64 (6), covariance.f64 (36), rounds.f64, atoms.f64, patches.f64,
// share.f64 (of the patches), and solve_ms.f64
#include "daemon/solve/model.h"

#include "base/clock.h"
#include "sensor/gel_file.h"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

using namespace tractiond;

int main(int argc, char** argv) {
  if (argc != 5 && argc != 6) return 64;
  const std::filesystem::path job = argv[1];
  const auto sensor = sensor::loadGel(argv[2]);
  if (!sensor) {
    std::cerr << sensor.error().what << "\n";
    return 65;
  }
  solve::ModelOptions options;
  options.noise_px = std::stod(argv[3]);
  const bool alone = std::string(argv[4]) == "field";
  if (argc == 6) options.faintest = std::stod(argv[5]);
  const solve::Atoms atoms = solve::makeAtoms(*sensor);
  const auto factors = solve::computeFactors(*sensor, atoms, options);
  if (!factors) {
    std::cerr << factors.error().message() << "\n";
    return 65;
  }
  solve::Model model = alone ? solve::Model(*factors, atoms, options) : solve::Model(*sensor, *factors, atoms, options);
  solve::Estimate estimate;
  estimate.force_N.resize(3 * static_cast<std::size_t>(atoms.pointCount()));

  std::ifstream in(job / "moved_px.f64", std::ios::binary);
  const auto open = [&](const char* name) {
    return std::ofstream(job / (std::string(name) + ".f64"), std::ios::binary);
  };
  std::ofstream wrench = open("wrench"), covariance = open("covariance"), rounds = open("rounds"),
                atomCount = open("atoms"), patchCount = open("patches"), share = open("share"), time = open("solve_ms");
  const auto write = [](std::ofstream& out, const double* numbers, std::size_t count) {
    out.write(reinterpret_cast<const char*>(numbers), static_cast<std::streamsize>(count * sizeof *numbers));
  };
  std::vector<double> moved(static_cast<std::size_t>(factors->coordinateCount()));
  while (in.read(reinterpret_cast<char*>(moved.data()), static_cast<std::streamsize>(moved.size() * sizeof(double)))) {
    const std::vector<float> displacement(moved.begin(), moved.end());
    const std::int64_t begin_ns = monotonicNow();
    model.solve(displacement, {}, options.noise_px, estimate);
    const std::int64_t end_ns = monotonicNow();
    const double took_ms = 1e-6 * static_cast<double>(end_ns - begin_ns);
    const double roundCount = estimate.rounds, atomNumber = estimate.atoms, patchNumber = estimate.patchCount;
    write(wrench, estimate.wrench.data(), estimate.wrench.size());
    write(covariance, estimate.covariance.data(), estimate.covariance.size());
    write(rounds, &roundCount, 1);
    write(atomCount, &atomNumber, 1);
    write(patchCount, &patchNumber, 1);
    write(share, &estimate.patchShare, 1);
    write(time, &took_ms, 1);
  }
  return wrench && covariance && rounds && atomCount && patchCount && share && time ? 0 : 74;
}
