#include "sensor/sensor.h"

namespace sensor {

int Sensor::markerCount() const {
  int count = 0;
  for (const MarkerLayer& layer : layers) count += layer.count();
  return count;
}

}  // namespace sensor
