// Elastic energies of strands and their gradients: bending, and torsion "frenet" and "rotor".
//
// Source: KIST lecture "Hair Simulation 2" (Physically Based Animation, 2008); rotor: physics.md section 2.
// Notation: d_j unit edge of segment j, il its inverse length now, l and dl rest lengths; at point i
//     c = d_i - d_{i-1},  e = d_i + d_{i-1},  kappa = 2 |c| / (dl |e|)
// All energies are functions of unit edges only, so that they do not see stretch (with "dl fixed" in the lecture's
// point form a stretched strand gets a spurious tension of 30 strand weights). D_j is the gradient by d_j; the force of
// an edge on its end points is -+ (I - d d^T) D / length.
// The lecture's slides have four errors in the gradients: test_gradients_agree_with_complex_step proves these forms.
#pragma once

#include "block.hpp"
#include "settings.hpp"

namespace ringlet {

/// Unit edges of a block of strands and the gradient of the energy by them; P - 1 entries each.
template <class Real> struct Edges {
    Vec3<Real> *d, *D;
    Lanes<Real> *il;
    Lanes<Real> *D_theta; // gradient by a turn of the director

    Edges(Arena &arena, int P)
        : d(arena.take<Vec3<Real>>(P)), D(arena.take<Vec3<Real>>(P)), il(arena.take<Lanes<Real>>(P)),
          D_theta(arena.take<Lanes<Real>>(P)) {}

    /// Unit edges of the points; gradients start from zero.
    void set(const Vec3<Real> *x, int P) {
        for (int j = 0; j < P - 1; ++j) {
            Vec3<Real> edge = x[j + 1] - x[j];
            il[j] = inverse_root<Real>(dot(edge, edge));
            d[j] = il[j] * edge;
            D[j] = Vec3<Real>{}, D_theta[j] = Lanes<Real>{};
        }
    }
};

/// The part of a gradient by a unit edge that turns the edge, per length: what its end points feel.
template <class Real> RINGLET_INLINE Vec3<Real> turning(Vec3<Real> D, Vec3<Real> d, Lanes<Real> il) {
    return il * (D - dot(D, d) * d);
}

/// Adds the forces -dE/dx to f, P entries.
template <class Real> void add_edge_forces(const Edges<Real> &edges, int P, Vec3<Real> *f) {
    for (int j = 0; j < P - 1; ++j) {
        Vec3<Real> F = turning<Real>(edges.D[j], edges.d[j], edges.il[j]);
        f[j] = f[j] + F;
        f[j + 1] = f[j + 1] - F;
    }
}

/// Curvature at a bend and its derivatives by c and e, which are multiples of c and e.
template <class Real> struct Bend {
    using L = Lanes<Real>;
    Vec3<Real> c, e;
    L kappa, by_c, by_e; // dkappa/dc = by_c c, dkappa/de = by_e e
    L ratio;             // kappa_r / kappa, 0 for naturally straight
    L inverse_ee;

    /// Two guards that keep the gradient exact: |e| counts at least 0.1 (a fold sharper than 168 degrees), and
    /// |c| is rounded by 1e-4 of its rest value, where kappa of curly hair has a cusp.
    RINGLET_INLINE Bend(const Block<Real> &b, const Edges<Real> &edges, int i)
        : c(edges.d[i] - edges.d[i - 1]), e(edges.d[i] + edges.d[i - 1]) {
        const L least = splat(Real(1e-2)), zero = splat(Real(0)), kappa_r = b.kappa_r[i];
        L ee = dot(e, e), rounding = Real(1e-4) * kappa_r * b.dl[i];
        L cc = dot(c, c) + rounding * rounding;
        inverse_ee = reciprocal<Real>(maximum<Real>(ee, least));
        // r = |c| / |e|, and its inverse where there is a bend
        L square = cc * inverse_ee, inverse_r = select<Real>(cc > zero, inverse_root<Real>(square), zero);
        kappa = 2 * b.inverse_dl[i] * square * inverse_r;
        by_c = 2 * b.inverse_dl[i] * inverse_ee * inverse_r;
        by_e = select<Real>(ee > least, -kappa * inverse_ee, zero);
        ratio = Real(0.5) * kappa_r * b.dl[i] * inverse_r;
    }
};

/// Adds the gradient of k_kappa (kappa - kappa_r)^2 dl / 2 at point i; returns the energy.
template <class Real>
RINGLET_INLINE Lanes<Real> add_bend_gradient(const Block<Real> &b, const Bend<Real> &bend, Edges<Real> &edges, int i) {
    Lanes<Real> stiffness = b.k_kappa * b.dl[i], excess = bend.kappa - b.kappa_r[i];
    // kappa by_c = 4 / (dl^2 |e|^2) has no cusp; the excess enters as 1 - ratio
    Lanes<Real> along_c = 4 * b.k_kappa * b.inverse_dl[i] * (1 - bend.ratio) * bend.inverse_ee;
    Lanes<Real> along_e = stiffness * excess * bend.by_e;
    edges.D[i - 1] = edges.D[i - 1] - along_c * bend.c + along_e * bend.e;
    edges.D[i] = edges.D[i] + along_c * bend.c + along_e * bend.e;
    return Real(0.5) * stiffness * excess * excess;
}

/// Adds the gradient of bending over all inner points; returns the energy.
template <class Real> Lanes<Real> add_bending(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 1; i < b.P - 1; ++i) energy += add_bend_gradient(b, Bend<Real>(b, edges, i), edges, i);
    return energy;
}

/// Adds the gradient of "rotor" about segment i; returns the energy
///     G/2 |sqrt(rho) R(phi_r) beta_i - beta_{i+1} / sqrt(rho)|^2,   beta = d x d.
template <class Real> RINGLET_INLINE Lanes<Real> add_rotor_gradient(const Block<Real> &b, Edges<Real> &edges, int i) {
    const Vec3<Real> d0 = edges.d[i - 1], d1 = edges.d[i], d2 = edges.d[i + 1];
    const Lanes<Real> G = b.G[i], C = G * b.C[i], S = G * b.S[i];
    const Lanes<Real> R = G * b.root[i] * b.root[i], I = G * b.inverse_root[i] * b.inverse_root[i];
    Lanes<Real> p = dot(d0, d1), q = dot(d1, d2);
    Vec3<Real> d12 = cross(d1, d2), d01 = cross(d0, d1), d20 = cross(d2, d0);
    Lanes<Real> u0 = R * p + C * q, u2 = I * q + C * p;
    edges.D[i - 1] = edges.D[i - 1] - (u0 * d1 - C * d2 + S * d12);
    edges.D[i] = edges.D[i] - (u0 * d0 + u2 * d2 + S * d20);
    edges.D[i + 1] = edges.D[i + 1] - (u2 * d1 - C * d0 + S * d01);
    return Real(0.5) * (R * (1 - p * p) + I * (1 - q * q)) - C * (p * q - dot(d0, d2)) - S * dot(d0, d12);
}

/// Adds the gradient of "rotor" about segments 1 .. P-3; returns the energy.
template <class Real> Lanes<Real> add_rotor(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 1; i < b.P - 2; ++i) energy += add_rotor_gradient(b, edges, i);
    return energy;
}

/// Excess of the lecture's regularised torsion at a point, tau - s tau_r, and its gradient by the four edges d[0..3]
/// around it, with |c|^2 + (0.3)^2 for |c|^2 and s = |c|^2 / (|c|^2 + (0.3)^2). The lecture's general form, for unequal
/// spacing (see operators.hpp): q = w3 c3 / |e3| - w0 c0 / |e0|, with both weights 1 at equal spacing.
template <class Real> struct FrenetTorsion {
    using L = Lanes<Real>;
    L excess;
    Vec3<Real> by_d[4];

    RINGLET_INLINE FrenetTorsion(const Block<Real> &b, const Edges<Real> &edges, int i) {
        const Vec3<Real> *d = edges.d + i - 2;
        const L dl = b.dl[i], tau_r = b.tau_r[i], before = b.l[i - 1], after = b.l[i];
        const L w0 = after * b.inverse_l[i - 1] * dl * b.inverse_dl[i - 1];
        const L w3 = before * b.inverse_l[i] * dl * b.inverse_dl[i + 1];
        const L least = splat(Real(1e-2)), zero = splat(Real(0));
        Vec3<Real> c0 = d[1] - d[0], c = d[2] - d[1], c3 = d[3] - d[2];
        Vec3<Real> e0 = d[1] + d[0], e = d[2] + d[1], e3 = d[3] + d[2];
        // |e| counts at least 0.1
        L ee0 = dot(e0, e0), ee3 = dot(e3, e3);
        L i0 = inverse_root<Real>(maximum<Real>(ee0, least)), i3 = inverse_root<Real>(maximum<Real>(ee3, least));
        L j0 = i0 * i0, j3 = i3 * i3;
        i0 *= w0, i3 *= w3;
        Vec3<Real> q = i3 * c3 - i0 * c0, ec = cross(e, c);
        L inverse_cc = reciprocal<Real>(dot(c, c) + Real(kFrenetSquare)), s = dot(c, c) * inverse_cc;
        L alpha = Real(0.5) * inverse_cc * b.inverse_dl[i], tau = alpha * dot(ec, q);
        excess = tau - s * tau_r;
        // the chain rule, by c and e of the three points
        Vec3<Real> by_e = alpha * cross(c, q);
        Vec3<Real> by_c = alpha * cross(q, e) - (2 * inverse_cc * (tau + tau_r * (1 - s))) * c;
        Vec3<Real> by_c3 = (alpha * i3) * ec, by_c0 = (-alpha * i0) * ec;
        Vec3<Real> by_e3 = select<Real>(ee3 > least, -alpha * i3 * j3 * dot(c3, ec), zero) * e3;
        Vec3<Real> by_e0 = select<Real>(ee0 > least, alpha * i0 * j0 * dot(c0, ec), zero) * e0;
        by_d[0] = by_e0 - by_c0;
        by_d[1] = by_e0 + by_c0 + by_e - by_c;
        by_d[2] = by_e + by_c + by_e3 - by_c3;
        by_d[3] = by_e3 + by_c3;
    }
};

/// Adds the gradient of k_tau (tau - s tau_r)^2 dl / 2 at point i; returns the energy.
template <class Real>
RINGLET_INLINE Lanes<Real> add_frenet_gradient(const Block<Real> &b, const FrenetTorsion<Real> &torsion,
                                               Edges<Real> &edges, int i) {
    Lanes<Real> moment = b.k_tau * b.dl[i] * torsion.excess;
    for (int k = 0; k < 4; ++k) edges.D[i - 2 + k] = edges.D[i - 2 + k] + moment * torsion.by_d[k];
    return Real(0.5) * moment * torsion.excess;
}

/// Adds the gradient of "frenet" at points 2 .. P-3; returns the energy.
template <class Real> Lanes<Real> add_frenet(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 2; i < b.P - 2; ++i) energy += add_frenet_gradient(b, FrenetTorsion<Real>(b, edges, i), edges, i);
    return energy;
}

} // namespace ringlet
