// Where a step is linearised: at its start, or ahead of it, where the points are expected at the time of its forces.
//
// The step's matrix is not the exact derivative of its forces (Gauss-Newton), and its tension pulls along the edges at
// the start: linearised there it is of first order whatever theta is. With x^ = x + theta dt v, second-order near to
// where the forces of the step are taken, what is neglected is multiplied by a difference of second order:
//     f(x + theta dt u) = f(x^) - K(x^) theta dt (u - v)
// so that nothing is solved twice. Directors go along by parallel transport and find their twist there ("kirchhoff"),
// but for held ones, which the solve turns. Fast edges are not looked ahead farther than they may turn; any x^ is
// consistent, it only costs order.
// Measured: test_looking_ahead_is_worth_shorter_steps.
#pragma once

#include "twist.hpp"

namespace ringlet {

template <class Real> struct Ahead {
    Vec3<Real> *v, *m; // velocities and directors there
    Vec3<Real> *by; // how far edges are ahead
    Lanes<Real> *s;

    Ahead(Arena &arena, int P)
        : v(arena.take<Vec3<Real>>(P)), m(arena.take<Vec3<Real>>(P)), by(arena.take<Vec3<Real>>(P)),
          s(arena.take<Lanes<Real>>(P)) {}

    /// Takes the edges from the start to where they are expected after theta_dt, held points having the velocities u, but
    /// turned by no more than `most` [rad]. Returns the directors there.
    const Vec3<Real> *look(const Block<Real> &b, const Motion<Real> &from, const Vec3<Real> *u, Lanes<Real> theta_dt, Real most,
                           bool twists, Directors<Real> &directors, Edges<Real> &edges) {
        Lanes<Real> fastest = splat(Real(1e-20));
        for (int i = 0; i < b.P; ++i) {
            v[i] = i < b.first ? u[i] : select(b.free[i] > 0, from.v[i], u[i]);
            if (i == 0) continue;
            by[i - 1] = v[i] - v[i - 1];
            fastest = maximum<Real>(fastest, dot(by[i - 1], by[i - 1]) * edges.il[i - 1] * edges.il[i - 1]);
        }
        const Lanes<Real> time = minimum<Real>(theta_dt, most * inverse_root<Real>(fastest));
        for (int j = 0; j < b.P - 1; ++j) {
            by[j] = time * by[j];
            const Vec3<Real> before = edges.d[j], edge = (from.x[j + 1] - from.x[j]) + by[j];
            edges.il[j] = inverse_root<Real>(dot(edge, edge));
            edges.d[j] = edges.il[j] * edge;
            m[j] = squared(transport(from.m[j], before, edges.d[j]), edges.d[j]);
        }
        if (twists) directors.relax(b, edges.d, m, from.twist, s);
        for (int j = 0; j < b.P - 1; ++j) s[j] = s[j] * reciprocal<Real>(edges.il[j]);
        edges.ahead = by, edges.ahead_s = s;
        return twists ? directors.m : m;
    }
};

} // namespace ringlet
