#include "client/show/foxglove.h"

#include "client/show/page.h"
#include "client/show/scene.h"
#include "traction/v1/status.pb.h"

#include <foxglove/Grid.pb.h>
#include <foxglove/Log.pb.h>
#include <foxglove/RawImage.pb.h>
#include <foxglove/SceneUpdate.pb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

namespace traction::client::foxglove {

namespace {

constexpr char kDescriptors[] = {
#include "foxglove.descriptors.inc"
};

template <typename Vector>
double norm(const Vector& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

void set(google::protobuf::Timestamp& time, std::uint64_t time_ns) {
  time.set_seconds(static_cast<std::int64_t>(time_ns / 1'000'000'000));
  time.set_nanos(static_cast<std::int32_t>(time_ns % 1'000'000'000));
}

void set(::foxglove::Color& colour, double red, double green, double blue, double alpha) {
  colour.set_r(red);
  colour.set_g(green);
  colour.set_b(blue);
  colour.set_a(alpha);
}

/// Sets x, y and z of a point, a vector or a quaternion.
template <typename Any>
void setXyz(Any& to, const Vector3& from) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  to.set_z(from[2]);
}

/// Sets the position, and no rotation.
void set(::foxglove::Pose& pose, const Vector3& place) {
  setXyz(*pose.mutable_position(), place);
  pose.mutable_orientation()->set_w(1.0);
}

/// Adds an entity without a part.
/// \param sensor whose frame it is in
::foxglove::SceneEntity& addEntity(::foxglove::SceneUpdate& to, const char* id, const std::string& sensor,
                                   std::uint64_t time_ns) {
  ::foxglove::SceneEntity& entity = *to.add_entities();
  set(*entity.mutable_timestamp(), time_ns);
  entity.set_frame_id(sensor);
  entity.set_id(id);
  return entity;
}

/// Adds a text that faces the viewer.
void addText(::foxglove::SceneEntity& to, const Vector3& place, const Vector3& colour, const std::string& text) {
  auto& label = *to.add_texts();
  set(*label.mutable_pose(), place);
  label.set_billboard(true);
  label.set_font_size(3e-3);
  set(*label.mutable_color(), colour[0], colour[1], colour[2], 1.0);
  label.set_text(text);
}

/// Sets an arrow whose head is where the force acts, so that a press stands above the surface. An arrow points along x
/// before it is rotated; the rotation is by 180 degrees about the bisector of x and the force.
void set(::foxglove::ArrowPrimitive& arrow, const Vector3& head, const Vector3& force_N, double m_per_N, double width_m,
         double significance, bool doubted) {
  const double size = norm(force_N), length = m_per_N * size;
  Vector3 unit{}, tail{};
  for (std::size_t i = 0; i < 3; ++i) {
    unit[i] = force_N[i] / size;
    tail[i] = head[i] - m_per_N * force_N[i];
  }
  set(*arrow.mutable_pose(), tail);
  Vector3 half{unit[0] + 1.0, unit[1], unit[2]};
  if (norm(half) < 1e-9) half = {0.0, 1.0, 0.0};  // the force points along -x
  const double halfSize = norm(half);
  setXyz(*arrow.mutable_pose()->mutable_orientation(), {half[0] / halfSize, half[1] / halfSize, half[2] / halfSize});
  arrow.mutable_pose()->mutable_orientation()->set_w(0.0);
  const double headLength = std::min(2.0 * width_m, length);
  arrow.set_head_length(headLength);
  arrow.set_head_diameter(2.0 * width_m);
  arrow.set_shaft_length(length - headLength);
  arrow.set_shaft_diameter(width_m);
  const double opacity = std::clamp(significance, 0.2, 1.0);
  if (doubted) {
    set(*arrow.mutable_color(), 0.6, 0.6, 0.6, opacity);
  } else {
    set(*arrow.mutable_color(), 0.95, 0.55, 0.1, opacity);
  }
}

template <typename Message>
Drawn drawn(const char* topic, const char* schema, const Message& message) {
  return {topic, schema, message.SerializeAsString()};
}

Drawn line(const std::string& sensor, std::uint64_t time_ns, ::foxglove::Log::Level level, const std::string& what) {
  ::foxglove::Log log;
  set(*log.mutable_timestamp(), time_ns);
  log.set_level(level);
  log.set_message(what);
  log.set_name(sensor);
  return drawn("log", "foxglove.Log", log);
}

/// Returns a grid of normal force, shear force and the standard deviation of the normal force [N].
Drawn gridOf(const std::string& sensor, const Grid& nodes, const Field& field, std::uint64_t time_ns) {
  constexpr std::array kNames = {"normal_N", "shear_N", "normal_deviation_N"};
  ::foxglove::Grid grid;
  set(*grid.mutable_timestamp(), time_ns);
  grid.set_frame_id(sensor);
  const Vector2 first = nodes.position_m(0, 0);
  set(*grid.mutable_pose(), {first[0] - nodes.pitch_m / 2, first[1] - nodes.pitch_m / 2, 0.0});
  grid.mutable_cell_size()->set_x(nodes.pitch_m);
  grid.mutable_cell_size()->set_y(nodes.pitch_m);
  grid.set_column_count(nodes.columns);
  grid.set_cell_stride(sizeof(float) * kNames.size());
  grid.set_row_stride(grid.cell_stride() * nodes.columns);
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    auto& one = *grid.add_fields();
    one.set_name(kNames[i]);
    one.set_offset(static_cast<std::uint32_t>(i * sizeof(float)));
    one.set_type(::foxglove::PackedElementField::FLOAT32);
  }
  std::string& data = *grid.mutable_data();
  for (std::size_t i = 0; i < field.force_N.size(); ++i) {
    const auto& force = field.force_N[i];
    const std::array<float, kNames.size()> cell = {force[2], std::hypot(force[0], force[1]),
                                                   i < field.nodeDeviation_N.size() ? field.nodeDeviation_N[i][2] : 0};
    data.append(reinterpret_cast<const char*>(cell.data()), sizeof cell);
  }
  return drawn("grid", "foxglove.Grid", grid);
}

Drawn pictureOf(const std::string& sensor, const Preview& preview, std::uint64_t time_ns) {
  ::foxglove::RawImage image;
  set(*image.mutable_timestamp(), time_ns);
  image.set_frame_id(sensor);
  image.set_width(preview.width);
  image.set_height(preview.height);
  image.set_encoding(preview.channels == 1 ? "mono8" : "rgb8");
  image.set_step(preview.width * preview.channels);
  image.set_data(preview.pixels.data(), preview.pixels.size());
  return drawn("picture", "foxglove.RawImage", image);
}

}  // namespace

std::string_view descriptors() {
  return {kDescriptors, sizeof kDescriptors};
}

std::vector<Drawn> Drawing::draw(const Message& message, std::uint64_t time_ns, unsigned wanted) {
  std::vector<Drawn> all;
  if ((wanted & kLog) == 0) {  // when it is wanted again, it begins with the present state
    flags_ = 0;
    valid_ = true;
    camera_ = 0;
  }
  if (const auto* description = std::get_if<Description>(&message)) {
    description_ = *description;
    if ((wanted & kScene) != 0) drawScene(*description, time_ns, all);
  } else if (const auto* field = std::get_if<Field>(&message)) {
    if ((wanted & kLog) != 0) log(*field, time_ns, all);
    if ((wanted & (kScene | kGrid)) == 0 || !description_) return all;
    const std::vector<Vector3> places = nodePositions_m(*description_);
    if (places.size() != field->force_N.size()) return all;
    if ((wanted & kScene) != 0) drawScene(*field, places, time_ns, all);
    if ((wanted & kGrid) != 0 && !description_->body)
      all.push_back(gridOf(sensor_, description_->nodes, *field, time_ns));
  } else if (const auto* contacts = std::get_if<Contacts>(&message)) {
    if ((wanted & kScene) != 0) drawScene(*contacts, time_ns, all);
  } else if (const auto* status = std::get_if<Status>(&message)) {
    if ((wanted & kLog) != 0) log(*status, time_ns, all);
  } else if (const auto* preview = std::get_if<Preview>(&message)) {
    if ((wanted & kPicture) != 0) all.push_back(pictureOf(sensor_, *preview, time_ns));
  }
  return all;
}

/// Draws the gel as a transparent block. The shape of a body with an influence file is unknown.
void Drawing::drawScene(const Description& description, std::uint64_t time_ns, std::vector<Drawn>& to) const {
  if (!description.hasGel() || description.body) return;
  ::foxglove::SceneUpdate update;
  auto& block = *addEntity(update, "gel", sensor_, time_ns).add_cubes();
  const Vector3& size = description.gel.size_m;
  set(*block.mutable_pose(), {0.0, 0.0, size[2] / 2});
  setXyz(*block.mutable_size(), size);
  set(*block.mutable_color(), 0.5, 0.7, 0.9, 0.15);
  to.push_back(drawn("scene", "foxglove.SceneUpdate", update));
}

void Drawing::drawScene(const Field& field, const std::vector<Vector3>& places, std::uint64_t time_ns,
                        std::vector<Drawn>& to) const {
  const bool doubted = field.header.flags != 0;
  ::foxglove::SceneUpdate update;
  auto& forces = addEntity(update, "forces", sensor_, time_ns);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector3 force{field.force_N[i][0], field.force_N[i][1], field.force_N[i][2]};
    const double deviation = i < field.nodeDeviation_N.size() ? norm(field.nodeDeviation_N[i]) : 0.0;
    if (norm(force) < 1e-9) continue;
    const double significance = deviation > 0.0 ? norm(force) / (kSure * deviation) : 1.0;
    set(*forces.add_arrows(), places[i], force, kNode_m_per_N, 0.4e-3, significance, doubted);
  }
  auto& contacts = addEntity(update, "contacts", sensor_, time_ns);
  for (const Contact& contact : field.contacts) {
    if (norm(contact.force_N) < 1e-9) continue;
    const Vector3 at{contact.position_m[0], contact.position_m[1], 0.0};
    set(*contacts.add_arrows(), at, contact.force_N, kContact_m_per_N, 1.2e-3, 1.0, doubted);
    const double top = -kContact_m_per_N * std::max(contact.force_N[2], 0.0) - 4e-3;
    double variance = 0.0;  // of the force's size, times the size squared
    for (std::size_t i = 0; i < 3; ++i) variance += std::pow(contact.force_N[i] * contact.forceDeviation_N[i], 2);
    const double size = norm(contact.force_N);
    // A contact states the deviations that noise causes, the resultant all of them.
    addText(contacts, {at[0], at[1], top}, {0.95, 0.55, 0.1},
            format("%.3f N +- %.2g (noise)", size, 2.0 * std::sqrt(variance) / size));
  }
  to.push_back(drawn("scene", "foxglove.SceneUpdate", update));
}

/// Draws the contacts of traction-touch: an ellipse with its id, green while it sticks, yellow before it slips, red
/// when it does, grey where that is not known. They vanish with traction-touch.
void Drawing::drawScene(const Contacts& contacts, std::uint64_t time_ns, std::vector<Drawn>& to) const {
  constexpr int kPoints = 40;
  constexpr std::array<Vector3, 4> kColours = {
      {{0.6, 0.6, 0.6}, {0.3, 0.75, 0.45}, {0.95, 0.75, 0.1}, {0.9, 0.2, 0.15}}};
  constexpr double kAbove_m = -0.5e-3;  // outside of the gel
  ::foxglove::SceneUpdate update;
  auto& entity = addEntity(update, "touch", sensor_, time_ns);
  entity.mutable_lifetime()->set_seconds(1);
  for (const TrackedContact& contact : contacts.contacts) {
    if (!isSeen(contact)) continue;
    const Vector3& colour = kColours.at(static_cast<std::size_t>(contact.slip ? contact.slip->state : SlipState{}));
    const auto& [x, y] = contact.position_m;
    const double across = contact.halfAxes_m[0] > 0.0 ? contact.halfAxes_m[0] : contact.radius_m;
    const double along = contact.halfAxes_m[1] > 0.0 ? contact.halfAxes_m[1] : contact.radius_m;
    const double cosine = std::cos(contact.orientation_rad), sine = std::sin(contact.orientation_rad);
    auto& ellipse = *entity.add_lines();
    ellipse.set_type(::foxglove::LinePrimitive::LINE_LOOP);
    ellipse.mutable_pose()->mutable_orientation()->set_w(1.0);
    ellipse.set_thickness(0.6e-3);
    set(*ellipse.mutable_color(), colour[0], colour[1], colour[2], 1.0);
    for (int i = 0; i < kPoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kPoints;
      const double u = across * std::cos(angle), v = along * std::sin(angle);
      setXyz(*ellipse.add_points(),
             {x + cosine * u - sine * v, y + sine * u + cosine * v, contact.positionZ_m + kAbove_m});
    }
    addText(entity, {x, y + across + 3e-3, contact.positionZ_m + kAbove_m}, colour,
            std::to_string(contact.id) + ": stick ratio " + stickRatio(contact));
  }
  to.push_back(drawn("scene", "foxglove.SceneUpdate", update));
}

void Drawing::log(const Field& field, std::uint64_t time_ns, std::vector<Drawn>& to) {
  for (const std::string& word : words(field.header.flags & ~flags_))
    to.push_back(line(sensor_, time_ns, ::foxglove::Log::WARNING, word));
  if (valid_ && !field.valid)
    to.push_back(line(sensor_, time_ns, ::foxglove::Log::ERROR, "the field is not valid: it has no forces"));
  flags_ = field.header.flags;
  valid_ = field.valid;
}

void Drawing::log(const Status& status, std::uint64_t time_ns, std::vector<Drawn>& to) {
  if (status->camera() != camera_) {
    const bool streams = status->camera() == v1::CAMERA_STATE_STREAMING;
    to.push_back(line(sensor_, time_ns, streams ? ::foxglove::Log::INFO : ::foxglove::Log::WARNING,
                      streams ? "the camera streams" : "the camera does not stream: " + status->camera_why()));
  }
  camera_ = status->camera();
}

}  // namespace traction::client::foxglove
