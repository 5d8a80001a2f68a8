// What each joint and segment adds to the system of a step: its force, and its stiffness scaled by `scale`.
//
//     K = sum k_kappa dl grad(kappa) grad(kappa)^T + max(0, 1 - kappa_r/kappa) transverse bending
//         + torsion Gauss-Newton + k_s d d^T + (T/l)^+ (I - d d^T)      (physics.md section 3)
//     k_s = max(1e3 m0/dt^2, 10 T/l)
// Every function here takes the window whose first point is the first that it touches; `force` says whether the
// gradient is added to the edges too (not when a system is solved again).
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

/// w a a^T + diagonal I, as the 6 entries of a symmetric block.
template <class Real>
RINGLET_INLINE void outer(Vec3<Real> a, Lanes<Real> (&block)[6], Lanes<Real> w, Lanes<Real> diagonal) {
    block[0] = w * a.x * a.x + diagonal, block[1] = w * a.x * a.y, block[2] = w * a.x * a.z;
    block[3] = w * a.y * a.y + diagonal, block[4] = w * a.y * a.z, block[5] = w * a.z * a.z + diagonal;
}

/// What consecutive points feel when their edges turn by the `Edges` gradients g: -g0, g0 - g1, ..., as numbers.
template <class Real, int Edges>
RINGLET_INLINE void point_gradient(const Vec3<Real> (&g)[Edges], Lanes<Real> (&at)[3 * Edges + 3]) {
    Vec3<Real> before{};
    for (int k = 0; k <= Edges; ++k) {
        const Vec3<Real> now = k < Edges ? g[k] : Vec3<Real>{}, there = before - now;
        at[3 * k] = there.x, at[3 * k + 1] = there.y, at[3 * k + 2] = there.z;
        before = now;
    }
}

/// Bending at point i: the exact rank-1 term of grad(kappa), without which tight curls blow up at 2 ms, and the
/// transverse part.
template <class Real, class Window>
RINGLET_INLINE void add_bend(const Block<Real> &b, Edges<Real> &edges, int i, bool force, Lanes<Real> scale,
                             Window &window) {
    const Bend<Real> bend(b, edges, i);
    if (force) add_bend_gradient(b, bend, edges, i);

    const Lanes<Real> il0 = edges.il[i - 1], il1 = edges.il[i], k = scale * b.k_kappa;
    const Vec3<Real> along_c = bend.by_c * bend.c, along_e = bend.by_e * bend.e;
    Lanes<Real> gradient[9];
    const Vec3<Real> turns[2] = {turning(along_e - along_c, edges.d[i - 1], il0),
                                 turning(along_e + along_c, edges.d[i], il1)};
    point_gradient<Real, 2>(turns, gradient);
    window.template add_square<9>(gradient, k * b.dl[i]);

    Lanes<Real> block[6], open = maximum<Real>(1 - bend.ratio, splat(Real(0)));
    outer(bend.c, block, -open * reciprocal<Real>(dot(bend.c, bend.c) + Real(1e-12)), open);
    const Lanes<Real> w = 4 * k * b.inverse_dl[i] * bend.inverse_ee * il0 * il1;
    window.template add_block<0, 0>(w, block);
    window.template add_block<0, 1>(-2 * w, block);
    window.template add_block<0, 2>(w, block);
    window.template add_block<1, 1>(4 * w, block);
    window.template add_block<1, 2>(-2 * w, block);
    window.template add_block<2, 2>(w, block);
}

/// Two unit vectors that make an orthonormal basis with d
/// ("Building an orthonormal basis, revisited", Duff et al. 2017).
template <class Real> RINGLET_INLINE void complete_basis(Vec3<Real> d, Vec3<Real> (&m)[2]) {
    Lanes<Real> sign = d.z >= 0 ? splat(Real(1)) : splat(Real(-1));
    Lanes<Real> a = -reciprocal<Real>(sign + d.z), xy = d.x * d.y * a;
    m[0] = {1 + sign * d.x * d.x * a, sign * xy, -sign * d.x};
    m[1] = {xy, sign + d.y * d.y * a, -d.y};
}

/// "rotor" about segment i: its energy is G/2 |r|^2 with r = sqrt(rho) R beta_i - beta_{i+1} / sqrt(rho); two rows m.r.
template <class Real, class Window>
RINGLET_INLINE void add_rotor(const Block<Real> &b, Edges<Real> &edges, int i, bool force, Lanes<Real> scale,
                              Window &window) {
    if (force) add_rotor_gradient(b, edges, i);
    const Vec3<Real> *d = edges.d + i - 1;
    const Lanes<Real> *il = edges.il + i - 1, inverse = b.inverse_root[i];
    const Lanes<Real> C = b.root[i] * b.C[i], S = b.root[i] * b.S[i];
    Vec3<Real> basis[2];
    complete_basis(d[1], basis);
    Lanes<Real> gradient[2][12];
    for (int row = 0; row < 2; ++row) {
        const Vec3<Real> m = basis[row], side = cross(d[1], m), turned = C * m - S * side; // sqrt(rho) R^T m
        const Vec3<Real> turns[3] = {turning(cross(d[1], turned), d[0], il[0]),
                                     turning(cross(turned, d[0]) - inverse * cross(d[2], m), d[1], il[1]),
                                     turning(inverse * side, d[2], il[2])};
        point_gradient<Real, 3>(turns, gradient[row]);
    }
    window.add_squares(gradient[0], gradient[1], scale * b.G[i]);
}

/// "rotor" at a clamped root: the window begins at point 0; the director m of segment 0 turns at a known
/// rate [1/s].
template <class Real, class Window>
RINGLET_INLINE void add_root(const Block<Real> &b, Edges<Real> &edges, Vec3<Real> m, Lanes<Real> rate, bool force,
                             Lanes<Real> scale, Window &window) {
    const RootBend<Real> root(b, edges, m);
    if (force) add_root_gradient(b, root, edges);
    Lanes<Real> gradient[2][9];
    for (int a = 0; a < 2; ++a) {
        const Vec3<Real> turns[2] = {turning(root.by_d0[a], edges.d[0], edges.il[0]),
                                     turning(root.by_d1[a], edges.d[1], edges.il[1])};
        point_gradient<Real, 2>(turns, gradient[a]);
        const Lanes<Real> known = scale * b.root_weight * root.by_theta[a] * rate;
        for (int k = 0; k < 9; ++k) window.right[k] -= known * gradient[a][k];
    }
    window.add_squares(gradient[0], gradient[1], scale * b.root_weight);
}

/// "frenet" at point i: Gauss-Newton, one row of five points.
template <class Real, class Window>
RINGLET_INLINE void add_frenet(const Block<Real> &b, Edges<Real> &edges, int i, bool force, Lanes<Real> scale,
                               Window &window) {
    const FrenetTorsion<Real> torsion(b, edges, i);
    if (force) add_frenet_gradient(b, torsion, edges, i);
    Vec3<Real> turns[4];
    for (int k = 0; k < 4; ++k) turns[k] = turning(torsion.by_d[k], edges.d[i - 2 + k], edges.il[i - 2 + k]);
    Lanes<Real> gradient[15];
    point_gradient<Real, 4>(turns, gradient);
    window.add_square(gradient, scale * b.k_tau * b.dl[i]);
}

/// Stretch of segment j and the stiffness of its tension T.
template <class Real, class Window>
RINGLET_INLINE void add_stretch(const Block<Real> &b, const Edges<Real> &edges, int j, Lanes<Real> T, Lanes<Real> scale,
                                Real dt, Window &window) {
    Lanes<Real> block[6], tight = maximum<Real>(T, splat(Real(0))) * edges.il[j] * b.per_mass;
    outer(edges.d[j], block, stretch_stiffness(b, T, j, dt) - tight, tight);
    const Lanes<Real> w = scale * b.m0;
    window.template add_block<0, 0>(w, block);
    window.template add_block<0, 1>(-w, block);
    window.template add_block<1, 1>(w, block);
}

} // namespace ringlet
