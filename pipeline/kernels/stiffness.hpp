// What each joint and segment adds to the system of a step: its gradient to the edges, its stiffness to the assembly.
//
//     K = sum g g^T (Gauss-Newton, for bending and torsion) + max(0, 1 - kappa_r/kappa) transverse bending
//         + k_s d d^T + (T/l)^+ (I - d d^T),      k_s = max(1e3 m0/dt^2, 10 T/l)
// The exact g g^T of bending is needed: without it tight curls blow up at 2 ms. All is by edges: see banded.hpp.
// Internal damping is beta times the g g^T only, which a rigid turn leaves alone. The other stiffness would brake it: k_s
// the more, the shorter the step (test_the_motion_converges_with_damping). The tension is that of the step's end,
// whatever theta is: with theta's mean it rings, and tight curls never rest at 1/60 s
// (test_tight_curls_come_to_rest_in_long_steps).
#pragma once

#include "banded.hpp"
#include "energy.hpp"
#include "root.hpp"

namespace ringlet {

/// Stretch stiffness k_s of segment j over m0. Stiffer than the tension, or a loaded strand goes unstable.
template <class Real>
RINGLET_INLINE Lanes<Real> stretch_stiffness(const Block<Real> &b, Lanes<Real> T, int j, Real dt) {
    return maximum<Real>(splat(Real(1e3) / (dt * dt)), 10 * T * b.inverse_l[j] * b.per_mass);
}

/// The symmetric 3x3 block w a a^T + diagonal I: its entries xx, xy, xz, yy, yz, zz.
template <class Real> struct Outer {
    Lanes<Real> entries[6]{};

    Outer() = default;

    RINGLET_INLINE Outer(Vec3<Real> a, Lanes<Real> w, Lanes<Real> diagonal) {
        const Vec3<Real> wa = w * a;
        entries[0] = wa.x * a.x + diagonal, entries[1] = wa.x * a.y, entries[2] = wa.x * a.z;
        entries[3] = wa.y * a.y + diagonal, entries[4] = wa.y * a.z, entries[5] = wa.z * a.z + diagonal;
    }

    RINGLET_INLINE void add(Lanes<Real> times, const Outer &other) {
        for (int k = 0; k < 6; ++k) entries[k] += times * other.entries[k];
    }

    friend RINGLET_INLINE Vec3<Real> operator*(const Outer &a, Vec3<Real> b) {
        return {a.entries[0] * b.x + a.entries[1] * b.y + a.entries[2] * b.z,
                a.entries[1] * b.x + a.entries[3] * b.y + a.entries[4] * b.z,
                a.entries[2] * b.x + a.entries[4] * b.y + a.entries[5] * b.z};
    }

    RINGLET_INLINE Lanes<Real> at(int row, int column) const {
        const int low = row < column ? row : column, high = row < column ? column : row;
        return entries[triangle(3, low) + high];
    }
};

/// The derivatives of a joint's residuals as numbers, over the first edges of a window.
template <class Real, int Count, int Reach, int Columns>
RINGLET_INLINE void write_rows(const Squares<Real, Count, Reach> &joint, Lanes<Real> (*rows)[Columns]) {
    for (int k = 0; k < Count; ++k)
        for (int j = 0; j < Reach; ++j) {
            const Vec3<Real> g = joint.g[k][j];
            rows[k][3 * j] = g.x, rows[k][3 * j + 1] = g.y, rows[k][3 * j + 2] = g.z;
        }
}

/// Stiffness of a bend across c, by both edges alike: + at their diagonal blocks, - beside them.
template <class Real> RINGLET_INLINE Outer<Real> stiffness_across(const Bend<Real> &bend) {
    return {bend.c, -bend.open * reciprocal<Real>(bend.cc + Real(1e-12)), bend.open};
}

/// What the stiffness across adds to the gradient F by the two edges, extrapolated back to the step's start.
template <class Real>
RINGLET_INLINE void look_back(const Outer<Real> &across, const Edges<Real> &edges, int i, const Scale<Real> &scale,
                              Vec3<Real> *F) {
    if (!edges.ahead) return;
    const Vec3<Real> back = (scale.inverse / scale.undamped) * (across * (edges.ahead[i] - edges.ahead[i + 1]));
    F[0] = F[0] - back;
    F[1] = F[1] + back;
}

/// Stretch of segment j, and the stiffness of its tension T, in the units of the system.
template <class Real>
RINGLET_INLINE Outer<Real> stretch(const Block<Real> &b, const Edges<Real> &edges, int j, Lanes<Real> T, double dt) {
    const Lanes<Real> theta_dt = b.theta * Real(dt);
    const Lanes<Real> tight = (theta_dt * theta_dt) * b.per_mass * maximum<Real>(T, splat(Real(0))) * edges.il[j];
    return {edges.d[j], theta_dt * Real(dt) * stretch_stiffness(b, T, j, Real(dt)) - tight, tight};
}

/// What pulls the ends of segment j together at the step's start: the tension, turned back where edges are ahead.
template <class Real> RINGLET_INLINE Vec3<Real> tension(const Edges<Real> &edges, int j, Lanes<Real> T) {
    if (!edges.ahead) return T * edges.d[j];
    return T * edges.d[j] - turning(maximum<Real>(T, splat(Real(0))) * edges.ahead[j], edges.d[j], edges.il[j]);
}

} // namespace ringlet
