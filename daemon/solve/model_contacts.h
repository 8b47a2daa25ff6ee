// Lists the contacts of an estimate of the statistical model (docs/mathematics.md, 4.7).
//
// If patches are likelier than the field alone, each patch, or each group of patches that are parts of one contact, is
// a contact. Other forces nearby are added to it; the hills of forces away from all patches are further contacts.
// Without patches the contacts are the hills of the points' forces. The wrenches of all contacts about the origin add
// up to the resultant, if those that are too uncertain to be listed are included.
#pragma once

#include "daemon/solve/hills.h"
#include "daemon/solve/systematic.h"

#include <optional>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class ModelContacts {
 public:
  /// `atoms` and `systematic` must outlive it; `sensor` is used by the constructor only.
  ModelContacts(const Atoms& atoms, const sensor::Sensor& sensor, const SystematicPart& systematic);

  /// Lists the contacts of an estimate, strongest first. Returns their number, 0 to kMaxContacts; 0 if the outcome is
  /// not kFound.
  /// \param mixture that the estimate is the mean of
  /// \param least_N beside patches, least force of a contact without a patch
  int list(const Estimate& estimate, Mixture& mixture, double least_N, std::array<Contact, kMaxContacts>& contacts);

 private:
  static constexpr int kMost = RoundPatches::kMost;

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
  Hills hills_;
  // Of one frame.
  std::vector<unsigned char> has_;                  // P: points whose forces make contacts of their own
  std::array<std::vector<double>, kMost> ofPatch_;  // 3 (P + kCouples): forces of each patch
  std::vector<int> nearest_;                        // P: patch
  std::vector<double> part_, forces_;               // P, 3P: of one contact
  std::vector<double> nodeForces_;                  // 3N: likewise
  std::vector<double> weights_;                     // 3 (P + kCouples) x kColumns: likewise
  std::vector<int> points_;                         // that have a part in it
};

}  // namespace tractiond::solve
