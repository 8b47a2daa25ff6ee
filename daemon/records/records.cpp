#include "daemon/records/gel_report.h"
#include "daemon/records/traction_field.h"

namespace tractiond {

void MarkerField::resize(int markers) {
  displacement_px.assign(static_cast<std::size_t>(2 * markers), 0.0F);
  variance_px2.assign(static_cast<std::size_t>(markers), 0.0F);
  valid.assign(static_cast<std::size_t>(markers), 0);
}

void TractionField::resize(int markerCount, int nodeCount) {
  markers.resize(markerCount);
  force_N.assign(static_cast<std::size_t>(3 * nodeCount), 0.0F);
  deviation_N.assign(static_cast<std::size_t>(3 * nodeCount), 0.0F);
}

MarkerField blankMarkers(int markers) {
  MarkerField blank;
  blank.resize(markers);
  return blank;
}

TractionField blankField(int markers, int nodes) {
  TractionField blank;
  blank.resize(markers, nodes);
  return blank;
}

std::string GelReport::doubt() const {
  return fits() ? "" : "the gel file does not fit the picture, and no forces are valid: " + remark;
}

}  // namespace tractiond
