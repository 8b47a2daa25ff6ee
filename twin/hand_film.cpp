#include "twin/hand_film.h"

namespace twin {

namespace {

constexpr double kSmallest = 1e-6;                 // [N] smaller pressures are left out
constexpr std::uint32_t kOtherNoise = 0x5bd1e995;  // between the seeds of the fingers

}  // namespace

HandFilm::HandFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache,
                   const sensor::elastic::Progress& progress)
    : hand_(*scenario.hand, scenario.sensor.gel)
    , films_(2, GelFilm(scenario, seed, cache, progress)) {
  films_.back().reseed(seed ^ kOtherNoise);
}

void HandFilm::draw(int finger, Picture& picture, Truth& truth) {
  const RoundContact& contact = hand_.contact(finger);
  const Eigen::Matrix3Xd parts = contact.parts();
  std::vector<ContactState> states(static_cast<std::size_t>(parts.cols()));
  ContactState whole{.position = hand_.position(finger)};
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Eigen::Vector3d force = parts.col(static_cast<Eigen::Index>(i));
    if (force.cwiseAbs().maxCoeff() < kSmallest) continue;
    states[i] = {.position = whole.position, .force = force};
    whole.force += force;
  }
  GelFilm& film = films_[static_cast<std::size_t>(finger)];
  film.hold(std::move(states));
  film.draw(picture, truth);
  truth.contacts.clear();
  if (whole.isLoaded()) {
    truth.contacts.push_back({Contact::Shape::kHertz, contact.radius(), whole, contact.stickRatio(), {}});
  }
  truth.finger = finger;
  truth.hand = hand_.state();
}

}  // namespace twin
