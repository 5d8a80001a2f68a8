// How to step, and what moves the strands during one step.
#pragma once

#include "deformation.hpp"
#include "pose.hpp"

namespace ringlet {

enum class Torsion { none, frenet, rotor, kirchhoff };
enum class Relaxation { newton, sweep };

struct StepSettings {
    double dt = 1.0 / 240;             // [s]
    double theta = 0.6;                // implicitness, 0.5 .. 1
    double gravity[3] = {0, -9.81, 0}; // [m/s^2]
    double look_ahead = 0;             // [rad] an edge is looked ahead by no more; 0: not at all (ahead.hpp)
    double damping = 3e-3;             // [s] beta
    Torsion torsion = Torsion::rotor;
    Relaxation relaxation = Relaxation::newton;
    double tolerance = 1e-4;  // worst relative length error
    double friction = 0.3;    // Coulomb
    double drag = 3.3;        // [1/s] c_perp = drag + drag_speed |u_perp|
    double drag_speed = 4.5;  // [1/m]
    double drag_along = 0.4;  // c_par / c_perp
    bool is_explicit = false; // symplectic Euler, for validation
};

/// Poses at the two ends of a step, in float64 so that it can be halved.
struct Poses {
    Pose head[2], hand[2];

    Poses first_half() const { return {{head[0], middle_head()}, {hand[0], middle_hand()}}; }
    Poses second_half() const { return {{middle_head(), head[1]}, {middle_hand(), hand[1]}}; }

  private:
    Pose middle_head() const { return halfway(head[0], head[1]); }
    Pose middle_hand() const { return halfway(hand[0], hand[1]); }
};

/// One step or a fraction of one, in the precision of the strands.
template <class Real> struct Interval {
    double dt;
    Poses poses;
    Vec3<Real> gravity, wind;
    SkinStep<Real> skin = {};

    Interval halved(bool second) const {
        return {0.5 * dt, second ? poses.second_half() : poses.first_half(), gravity, wind, skin.halved(second)};
    }
};

} // namespace ringlet
