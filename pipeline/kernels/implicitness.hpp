// How implicit the step of each strand is: theta of the settings, up to 1 where the spacing is too fine for it.
//
// A joint that could swing much faster than it is looked at is taken by a step of theta to -(1 - theta)/theta of its
// swing. What is linear dies out by that; but the correction of lengths puts some of it back, and from some stiffness
// on more than the step takes: short strands of many points thrash, and end in loops
// (test_short_strands_of_fine_spacing_neither_thrash_nor_ring). With theta = 1 nothing of it is left. The measure is
//
//     N = B dt^2 / (m dl^3),      B the largest stiffness of a joint, m the mass of a point, dl the smallest spacing,
//
// the square of the swing's angle in a step but for a factor; 1 to 100 for a long strand. N^(1/4) goes with 1 / dl.
// Measured on the shipped styles: with theta = 0.6 strands of N^(1/4) from about 20 on thrash.
#pragma once

#include "block.hpp"
#include "settings.hpp"

namespace ringlet {

inline constexpr double kLoose = 6, kStiff = 18; // N^(1/4) from which on theta grows, and at which it is 1

/// Sets the implicitness of the block's strands.
template <class Real> void choose_theta(Block<Real> &b, const StepSettings &settings) {
    const Lanes<Real> none = splat(Real(0)), one = splat(Real(1));
    Lanes<Real> closest = none; // 1 / dl
    for (int j = 0; j < b.P - 1; ++j) closest = maximum<Real>(closest, b.inverse_l[j]);
    const Lanes<Real> B = maximum<Real>(maximum<Real>(b.k_kappa, b.k_kappa_2), b.k_tau);
    const Lanes<Real> swing = square_root<Real>(B * b.per_mass * closest) * (Real(settings.dt) * closest);
    const Lanes<Real> part = (square_root<Real>(swing) - Real(kLoose)) * Real(1 / (kStiff - kLoose));
    const Lanes<Real> theta = splat(Real(settings.theta));
    b.theta = settings.is_explicit ? one : theta + (one - theta) * maximum<Real>(none, -maximum<Real>(-part, -one));
}

} // namespace ringlet
