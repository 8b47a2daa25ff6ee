// One physical sensor as mathematics: what the gel file holds.
#pragma once

#include "sensor/gel.h"
#include "sensor/projection.h"

namespace sensor {

/// The paper's sensor by default.
struct Sensor {
  Gel gel;
  std::vector<MarkerLayer> layers = paperLayers();
  NodeGrid nodes;
  Camera camera;

  int markerCount() const;
};

}  // namespace sensor
