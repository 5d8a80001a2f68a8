// "rotor" at a clamped root: the direction of the first bend, without which a curl swivels about its root.
//
// The kappa-tau models see only how bends turn against each other, so that a strand whose points 0 and 1 are held could
// turn freely about segment 0. A ghost segment behind the root, carried by the head, makes the torsion about segment 0
// that is missing. Which ghost does not matter: "rotor" about segment 0 is
//     G/2 |sqrt(rho) R(phi_r) beta_0 - beta_1 / sqrt(rho)|^2,   beta_0 = d_{-1} x d_0,   beta_1 = d_0 x d_1,
// and R beta_0, which the head carries, is rho times the rest value of beta_1. With the directors m, n of segment 0,
// also carried by the head, beta_1 and its rest value are told by d_1.m and d_1.n:
//     E = G/2 sum_a r_a^2,    r_1 = d_1.m - u_1,   r_2 = d_1.n - u_2,     u the values at rest
// G is that of two bends b_1 (rho = 1): near rest k_tau (tau - tau_r)^2 l / 2 on segment 0. It acts where the head holds
// points 0 and 1, and fades on straight hair as "rotor" does.
// "frenet" is left as it is: its torsion is blind to dihedrals that change by turns, +a -a +a, and a curl swivels by
// them however its root is held (test_frenet_swivels_about_its_root).
#pragma once

#include "energy.hpp"

namespace ringlet {

/// The two residuals and their derivatives by edges 0 (m and n go along by parallel transport) and 1, and by a turn
/// theta_0.
template <class Real> struct RootBend : Squares<Real, 2, 2> {
    using L = Lanes<Real>;
    L by_theta[2];

    RINGLET_INLINE RootBend(const Block<Real> &b, const Edges<Real> &edges, Vec3<Real> m, const Scale<Real> &scale) {
        const L root = scale.root * square_root<Real>(b.root_weight);
        const Vec3<Real> d0 = edges.d[0], d1 = edges.d[1], frame[2] = {m, cross(d0, m)};
        const L p = dot(d0, d1), along[2] = {dot(d1, frame[0]), dot(d1, frame[1])};
        for (int a = 0; a < 2; ++a) {
            this->r[a] = root * (along[a] - b.root_bend[a]);
            this->g[a][0] = turning((-root * p) * frame[a], d0, edges.il[0]);
            this->g[a][1] = turning(root * frame[a], d1, edges.il[1]);
        }
        by_theta[0] = root * along[1], by_theta[1] = -root * along[0];
    }
};

/// Adds the gradient with the director m of segment 0; returns the energy.
template <class Real>
RINGLET_INLINE Lanes<Real> add_root_gradient(const RootBend<Real> &root, Edges<Real> &edges) {
    for (int a = 0; a < 2; ++a) edges.D_theta[0] += root.r[a] * root.by_theta[a];
    return root.add_gradient({}, edges.F);
}

/// Adds the gradient of torsion with the directors m: over the strand, and at the root where that is clamped.
template <class Real>
Lanes<Real> add_torsion(Torsion torsion, const Block<Real> &b, const Vec3<Real> *m, Edges<Real> &edges) {
    Lanes<Real> energy{};
    if (torsion == Torsion::frenet) energy = add_frenet(b, edges);
    if (torsion != Torsion::rotor) return energy;
    energy = add_rotor(b, edges);
    return b.clamped ? energy + add_root_gradient(RootBend<Real>(b, edges, m[0], {}), edges) : energy;
}

} // namespace ringlet
