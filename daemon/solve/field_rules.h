// Completes a field whose forces are known: centre of pressure, residual, flags.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/used_markers.h"

namespace tractiond::solve {

/// Makes the field not valid, with no contacts and Method::kNone, and sets the numbers that a solver computes to 0.
/// Leaves its markers and flags unchanged.
void clear(TractionField& field);

/// Sets the centre of pressure from the field's resultant and moment, if the normal force exceeds five of its
/// standard deviations by noise and `least_N`; else only marks it as not valid.
void centre(double least_N, TractionField& field);

/// Sets the residual; sets the flag kUnexplained if noise and model errors do not explain it.
/// \param squaredResidual_px2 sum over the coordinates of the used markers; below 0 counts as 0
/// \param markers whose last choose() returned true
void explain(double squaredResidual_px2, const UsedMarkers& markers, TractionField& field);

/// Returns whether residual, resultant, moment and contacts of the field, with their uncertainty, are finite. Does
/// not check the node forces.
bool finite(const TractionField& field);

}  // namespace tractiond::solve
