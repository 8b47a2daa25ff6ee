#include "client/viewer/places.h"

#include "client/show/scene.h"
#include "sensor/projection.h"

namespace traction::view {

std::vector<float> nodePlaces_px(const Description& description) {
  const Camera& from = description.camera;
  sensor::Camera camera;
  camera.width = static_cast<int>(from.width_px);
  camera.height = static_cast<int>(from.height_px);
  camera.focal_px = from.focal_px;
  camera.aspect = from.aspect;
  camera.principal_px = {from.principal_px[0], from.principal_px[1]};
  camera.k1 = from.k1;
  camera.k2 = from.k2;
  camera.fisheye = from.fisheye;
  camera.k3 = from.k3;
  camera.k4 = from.k4;
  camera.position = {from.position_m[0], from.position_m[1], from.position_m[2]};
  camera.rotation = {from.rotation_rad[0], from.rotation_rad[1], from.rotation_rad[2]};
  camera.gelIndex = from.gelIndex;
  camera.windowIndex = from.windowIndex;
  camera.windowThickness = from.windowThickness_m;
  for (const RefractingSurface& surface : from.surfaces) {
    camera.surfaces.push_back({.centre = Eigen::Vector3d::Map(surface.centre_m.data()),
                               .radii = Eigen::Vector3d::Map(surface.radii_m.data()),
                               .index = surface.index});
  }
  const double thickness = description.gel.size_m[2];
  // A description may hold any values: a projection from within the gel has no meaning.
  if (!sensor::isBehindWindow(camera, thickness) || !(from.focal_px > 0.0) || !(from.aspect > 0.0)) return {};

  const sensor::Projection project(camera, thickness);
  sensor::Camera plain = camera;  // for nodes that curved surfaces hide
  plain.surfaces.clear();
  plain.gelIndex = plain.windowIndex = 1.0;
  plain.windowThickness = 0.0;
  const sensor::Projection straight(plain, thickness);
  constexpr std::size_t kMostCrossings = 300'000;  // a tenth of a second; a description may come from anybody
  const std::vector<Vector3> nodes = client::nodePositions_m(description);
  if (nodes.size() * (1 + camera.surfaces.size()) > kMostCrossings) return {};
  std::vector<float> places;
  for (const Vector3& node : nodes) {
    const auto point = Eigen::Vector3d::Map(node.data());
    Eigen::Vector2d place = project(point);
    if (!place.allFinite()) place = straight(point);
    places.push_back(static_cast<float>(place.x()));
    places.push_back(static_cast<float>(place.y()));
  }
  return places;
}

}  // namespace traction::view
