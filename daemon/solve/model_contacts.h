// Lists the contacts of an estimate of the statistical model (docs/mathematics.md, 4.7).
//
// If patches are likelier than the field alone, each patch, or each group of patches that are parts of one contact, is
// a contact. Other forces nearby are added to it; the hills of forces away from all patches are further contacts.
// Without patches the contacts are the hills of the points' forces. The wrenches of all contacts about the origin add
// up to the resultant, if those that are too uncertain to be listed are included.
#pragma once

#include "daemon/solve/hills.h"
#include "daemon/solve/model.h"
#include "daemon/solve/systematic.h"

#include <optional>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class ModelContacts {
 public:
  /// `atoms` and `systematic` must outlive it; `sensor` is used by the constructor only.
  ModelContacts(const Atoms& atoms, const sensor::Sensor& sensor, const SystematicPart& systematic);

  /// Lists the contacts of an estimate, strongest first. Returns their number, 0 to kMaxContacts; 0 if the outcome is
  /// not kFound. \param mixture that the estimate is the mean of \param least_N beside patches, least force of a
  /// contact without a patch
  int list(const Estimate& estimate, Mixture& mixture, double least_N, std::array<Contact, kMaxContacts>& contacts);

 private:
  static constexpr int kMost = RoundPatches::kMost;

  /// Forces of some points, with the couples of the patches that are not contacts of their own.
  class Found final : public SolvedForces {
   public:
    explicit Found(const Atoms& atoms);
    /// Takes the points that have a force and are marked in `has` (P, 0 or 1). \param mixture as in list(), which must
    /// outlive the calls of covariances()
    void take(const Estimate& estimate, Mixture& mixture, std::span<const unsigned char> has);
    // Implement SolvedForces.
    std::span<const int> places() const override { return places_; }
    std::span<const double> forces_N() const override { return {forces_.data(), 3 * places_.size()}; }
    std::span<const int> couplesAt() const override { return {couplesAt_.data(), couples_.size() / 3}; }
    std::span<const double> couples_Nm() const override { return couples_; }
    void covariances(const double* functionals, std::span<const int> of,
                     std::array<double, kColumns * kColumns>& result) const override;
    void leastVariances(const double* functionals, std::span<const int> of,
                        std::array<double, kColumns>& variances) const override;
    const WrenchCovariance* wrenchCovariance() const override { return whole_; }

   private:
    int nearest(const PatchPlace& place) const;
    void weighPoints(const double* functionals, std::span<const int> of) const;

    const Atoms& atoms_;
    Mixture* mixture_ = nullptr;
    std::vector<int> places_;
    std::array<int, kCouples> couplesAt_{};
    std::span<const double> couples_;
    const WrenchCovariance* whole_ = nullptr;
    std::vector<double> forces_;
    mutable std::vector<double> weights_;  ///< 3 (P + kCouples) x kColumns, of points_
    mutable std::vector<int> points_;
  };

  int listHills(std::array<Contact, kMaxContacts>& contacts);
  int listPatches(const Estimate& estimate, Mixture& mixture, double least_N,
                  std::array<Contact, kMaxContacts>& contacts);
  void share(const Estimate& estimate);
  int listBeside(const Estimate& estimate, Mixture& mixture, double least_N,
                 std::array<Contact, kMaxContacts>& contacts);
  Eigen::Vector3d gather(const Estimate& estimate, int contact);
  Contact describe(const Estimate& estimate, Mixture& mixture, int contact);
  Eigen::Vector2d setFunctionals(const Estimate& estimate, int contact, const Eigen::Vector3d& force);
  std::optional<Contact> describeHill(int hill, double least_deviations, double least_N);
  void addSystematic(Contact& contact);
  static void setShape(const Estimate& estimate, int contact, const Eigen::Vector3d& along, Contact& result);
  static void setRound(const Estimate& estimate, int contact, Contact& result);

  const Atoms& atoms_;
  const SystematicPart& systematic_;
  PatchSpread spread_;
  Found found_;
  Hills hills_;
  // Of one frame.
  std::vector<unsigned char> has_;                  // P: points whose forces make contacts of their own
  std::vector<double> share_;                       // P
  std::array<std::vector<double>, kMost> ofPatch_;  // 3P: forces of each patch at the points
  std::vector<int> nearest_;                        // P: patch
  std::vector<double> part_, forces_;               // P, 3P: of one contact
  std::vector<double> nodeForces_;                  // 3N: likewise
  std::vector<double> weights_;                     // 3 (P + kCouples) x kColumns: likewise
  std::vector<int> points_;                         // that have a part in it
};

}  // namespace tractiond::solve
