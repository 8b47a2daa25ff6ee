#include "twin/creep.h"

#include <cmath>
#include <utility>

namespace twin {

Creep::Creep(std::vector<sensor::CreepTerm> terms, Eigen::Index markers)
    : terms_(std::move(terms))
    , follow_(terms_.size(), sensor::Points::Zero(3, markers))
    , last_(sensor::Points::Zero(3, markers))
    , sum_(sensor::Points::Zero(3, markers)) {}

void Creep::advance(double time_s, const sensor::Points& elastic) {
  const double step = hasBegun_ ? time_s - lastTime_s_ : 0.0;
  if (step > 0.0) {
    sum_.setZero();
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      const double steps = step / terms_[i].time_s, left = std::exp(-steps);
      const double mean = -std::expm1(-steps) / steps;  // mean of the decay over the step
      follow_[i] = left * follow_[i] + (mean - left) * last_ + (1.0 - mean) * elastic;
      sum_ += terms_[i].share * follow_[i];
    }
  }
  hasBegun_ = true;
  lastTime_s_ = time_s;
  last_ = elastic;
}

}  // namespace twin
