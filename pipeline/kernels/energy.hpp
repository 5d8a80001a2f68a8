// Elastic energies of strands and their gradients: bending, and torsion "frenet" and "rotor".
//
// Source: KIST lecture "Hair Simulation 2" (Physically Based Animation, 2008); rotor: docs/physics.md.
// Notation: d_j unit edge of segment j, il its inverse length now, l and dl rest lengths; at point i
//     c = d_i - d_{i-1},  e = d_i + d_{i-1},  kappa = 2 |c| / (dl |e|)
// All energies are functions of unit edges only, so that they do not see stretch (with "dl fixed" in the lecture's
// point form a stretched strand gets a spurious tension of 30 strand weights). Each is a sum of squares, r^2 / 2, whose
// residuals r have derivatives g by a few consecutive edges, g = (I - d d^T) (dr/dd) / length. F_j is the gradient of
// the energy by edge j, sum r g: what pulls its end points together. The same g make the stiffness (stiffness.hpp).
// The lecture's slides have four errors in the gradients: test_gradients_agree_with_complex_step proves these forms.
#pragma once

#include "block.hpp"
#include "settings.hpp"

namespace ringlet {

/// Unit edges of a block of strands and the gradient of the energy by the edges; P - 1 entries each.
template <class Real> struct Edges {
    Vec3<Real> *d, *F;
    Lanes<Real> *il;
    Lanes<Real> *D_theta; // gradient by a turn of the director
    const Vec3<Real> *ahead = nullptr; // how far the edges are ahead of the step's start (ahead.hpp); null: not
    Lanes<Real> *ahead_s = nullptr;    // and s of the directors

    Edges(Arena &arena, int P)
        : d(arena.take<Vec3<Real>>(P)), F(arena.take<Vec3<Real>>(P)), il(arena.take<Lanes<Real>>(P)),
          D_theta(arena.take<Lanes<Real>>(P)) {}

    /// Unit edges of the points.
    void follow(const Vec3<Real> *x, int P) {
        for (int j = 0; j < P - 1; ++j) {
            Vec3<Real> edge = x[j + 1] - x[j];
            il[j] = inverse_root<Real>(dot(edge, edge));
            d[j] = il[j] * edge;
        }
        ahead = nullptr;
    }

    /// The same; gradients start from zero.
    void set(const Vec3<Real> *x, int P) {
        follow(x, P);
        for (int j = 0; j < P - 1; ++j) F[j] = Vec3<Real>{}, D_theta[j] = Lanes<Real>{};
    }
};

/// The part of a derivative by a unit edge that turns the edge, per length: the derivative by the edge.
template <class Real> RINGLET_INLINE Vec3<Real> turning(Vec3<Real> D, Vec3<Real> d, Lanes<Real> il) {
    return il * (D - dot(D, d) * d);
}

/// Adds the forces -dE/dx to f, P entries.
template <class Real> void add_edge_forces(const Edges<Real> &edges, int P, Vec3<Real> *f) {
    for (int j = 0; j < P - 1; ++j) {
        f[j] = f[j] + edges.F[j];
        f[j + 1] = f[j + 1] - edges.F[j];
    }
}

/// What residuals and their derivatives are multiplied by, so that the squares of these are the stiffness in the units
/// of a system of equations; `inverse` = 1 / root^2 takes the gradient back to newtons. Root^2 holds the damping too:
/// `undamped` is the part of it without, for stiffness that has no damping.
template <class Real> struct Scale {
    Lanes<Real> root = splat(Real(1)), inverse = splat(Real(1));
    Lanes<Real> undamped = splat(Real(1));
};

/// An energy of squares: residuals and their derivatives by `Reach` consecutive edges, both times scale.root.
template <class Real, int Count, int Reach> struct Squares {
    Lanes<Real> r[Count];
    Vec3<Real> g[Count][Reach];

    /// Adds the gradient to the edges F[0 .. Reach-1]; returns the energy.
    RINGLET_INLINE Lanes<Real> add_gradient(const Scale<Real> &scale, Vec3<Real> *F) const {
        Lanes<Real> energy{};
        for (int k = 0; k < Count; ++k) {
            const Lanes<Real> moment = scale.inverse * r[k];
            for (int j = 0; j < Reach; ++j) F[j] = F[j] + moment * g[k][j];
            energy += Real(0.5) * moment * r[k];
        }
        return energy;
    }

    /// Residuals extrapolated back to the step's start, where the first edge is edge i.
    RINGLET_INLINE void look_back(const Edges<Real> &edges, int i) {
        if (!edges.ahead) return;
        for (int k = 0; k < Count; ++k)
            for (int j = 0; j < Reach; ++j) r[k] -= dot(g[k][j], edges.ahead[i + j]);
    }
};

/// Bending at point i: k_kappa (kappa - kappa_r)^2 dl / 2.
template <class Real> struct Bend : Squares<Real, 1, 2> {
    using L = Lanes<Real>;
    Vec3<Real> c;
    L cc, open; // |c|^2; stiffness across c by both edges, where the bend is open wider than at rest

    /// Two guards that keep the gradient exact: |e| counts at least 0.1 (a fold sharper than 168 degrees), and
    /// |c| is rounded by 1e-4 of its rest value, where kappa of curly hair has a cusp.
    RINGLET_INLINE Bend(const Block<Real> &b, const Edges<Real> &edges, int i, const Scale<Real> &scale)
        : c(edges.d[i] - edges.d[i - 1]), cc(dot(c, c)) {
        const L least = splat(Real(1e-2)), zero = splat(Real(0)), kappa_r = b.kappa_r[i];
        const L il0 = edges.il[i - 1], il1 = edges.il[i];
        const Vec3<Real> e = edges.d[i] + edges.d[i - 1];
        const L ee = dot(e, e), rounding = Real(1e-4) * kappa_r * b.dl[i], rounded = cc + rounding * rounding;
        const L inverse_ee = reciprocal<Real>(maximum<Real>(ee, least));
        // With ratio = |c| / |e| and its inverse where there is a bend: kappa = 2 / dl ratio, and by c and e its
        // derivatives are by_c c and by_e e
        const L square = rounded * inverse_ee;
        const L inverse_ratio = select<Real>(rounded > zero, inverse_root<Real>(square), zero);
        const L root = scale.root * b.root_kappa * b.root_dl[i], twice = 2 * root * b.inverse_dl[i];
        const L kappa = twice * square * inverse_ratio;
        const L by_c = twice * inverse_ee * inverse_ratio;
        const L by_e = select<Real>(ee > least, -kappa * inverse_ee, zero);
        this->r[0] = kappa - root * kappa_r;
        // Their part along an edge is the same for both: d.e = ee / 2, d.c = +- cc / 2
        const L along = Real(0.5) * (by_e * ee + by_c * cc);
        const Vec3<Real> turn_c = by_c * c, turn_e = by_e * e;
        this->g[0][0] = il0 * (turn_e - turn_c - along * edges.d[i - 1]);
        this->g[0][1] = il1 * (turn_e + turn_c - along * edges.d[i]);
        open = maximum<Real>(1 - Real(0.5) * kappa_r * b.dl[i] * inverse_ratio, zero) * (twice * twice) * inverse_ee *
               (il0 * il1) * scale.undamped;
    }
};

/// Adds the gradient of bending over all inner points; returns the energy.
template <class Real> Lanes<Real> add_bending(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 1; i < b.P - 1; ++i)
        energy += Bend<Real>(b, edges, i, Scale<Real>{}).add_gradient({}, edges.F + i - 1);
    return energy;
}

/// Two unit vectors that make a right-handed orthonormal basis with d
/// ("Building an orthonormal basis, revisited", Duff et al. 2017).
template <class Real> RINGLET_INLINE void complete_basis(Vec3<Real> d, Vec3<Real> (&m)[2]) {
    Lanes<Real> sign = d.z >= 0 ? splat(Real(1)) : splat(Real(-1));
    Lanes<Real> a = -reciprocal<Real>(sign + d.z), xy = d.x * d.y * a;
    m[0] = {1 + sign * d.x * d.x * a, sign * xy, -sign * d.x};
    m[1] = {xy, sign + d.y * d.y * a, -d.y};
}

/// "rotor" about segment i: |r|^2 / 2 with r = sqrt(G rho) R(phi_r) beta_i - sqrt(G / rho) beta_{i+1}, beta = d x d. Its
/// two residuals are m.r for an orthonormal basis m_0, m_1, d_1. With t = sqrt(G rho) R^T m
///     r_0 = t_1.d_0 + sqrt(G/rho) m_1.d_2,    r_1 = -t_0.d_0 - sqrt(G/rho) m_0.d_2
/// since d_1 x m_0 = m_1 and so d_1 x t_0 = t_1. R also turns with d_1, but only along d_1, where r has nothing.
template <class Real> struct Rotor : Squares<Real, 2, 3> {
    using L = Lanes<Real>;

    RINGLET_INLINE Rotor(const Block<Real> &b, const Edges<Real> &edges, int i, const Scale<Real> &scale) {
        const Vec3<Real> d0 = edges.d[i - 1], d1 = edges.d[i], d2 = edges.d[i + 1];
        const L il0 = edges.il[i - 1], il1 = edges.il[i], il2 = edges.il[i + 1];
        const L before = scale.root * b.G_before[i], after = scale.root * b.G_after[i];
        const L C = before * b.C[i], S = before * b.S[i];
        Vec3<Real> m[2];
        complete_basis(d1, m);
        const Vec3<Real> t[2] = {C * m[0] - S * m[1], C * m[1] + S * m[0]};
        const L t0 = dot(t[0], d0), t1 = dot(t[1], d0), m0 = dot(m[0], d2), m1 = dot(m[1], d2);
        this->r[0] = t1 + after * m1, this->r[1] = -t0 - after * m0;
        this->g[0][0] = il0 * (t[1] - t1 * d0), this->g[1][0] = il0 * (t0 * d0 - t[0]);
        const L p = il1 * dot(d0, d1), u = C * p + after * (il1 * dot(d1, d2)), w = S * p;
        this->g[0][1] = -w * m[0] - u * m[1], this->g[1][1] = u * m[0] - w * m[1];
        const L end = after * il2;
        this->g[0][2] = end * (m[1] - m1 * d2), this->g[1][2] = end * (m0 * d2 - m[0]);
    }
};

/// Adds the gradient of "rotor" about segments 1 .. P-3; returns the energy.
template <class Real> Lanes<Real> add_rotor(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 1; i < b.P - 2; ++i)
        energy += Rotor<Real>(b, edges, i, Scale<Real>{}).add_gradient({}, edges.F + i - 1);
    return energy;
}

/// "frenet" at point i, k_tau (tau - s tau_r)^2 dl / 2: the lecture's regularised torsion by the four edges around it,
/// with |c|^2 + (0.3)^2 for |c|^2 and s = |c|^2 / (|c|^2 + (0.3)^2). The lecture's general form, for unequal
/// spacing (see operators.hpp): q = w3 c3 / |e3| - w0 c0 / |e0|, with both weights 1 at equal spacing.
template <class Real> struct Frenet : Squares<Real, 1, 4> {
    using L = Lanes<Real>;

    RINGLET_INLINE Frenet(const Block<Real> &b, const Edges<Real> &edges, int i, const Scale<Real> &scale) {
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
        const L root = scale.root * b.root_tau * b.root_dl[i];
        this->r[0] = root * (tau - s * tau_r);
        // the chain rule, by c and e of the three points
        Vec3<Real> by_e = alpha * cross(c, q);
        Vec3<Real> by_c = alpha * cross(q, e) - (2 * inverse_cc * (tau + tau_r * (1 - s))) * c;
        Vec3<Real> by_c3 = (alpha * i3) * ec, by_c0 = (-alpha * i0) * ec;
        Vec3<Real> by_e3 = select<Real>(ee3 > least, -alpha * i3 * j3 * dot(c3, ec), zero) * e3;
        Vec3<Real> by_e0 = select<Real>(ee0 > least, alpha * i0 * j0 * dot(c0, ec), zero) * e0;
        const Vec3<Real> by_d[4] = {by_e0 - by_c0, by_e0 + by_c0 + by_e - by_c, by_e + by_c + by_e3 - by_c3,
                                    by_e3 + by_c3};
        for (int k = 0; k < 4; ++k) this->g[0][k] = turning(root * by_d[k], d[k], edges.il[i - 2 + k]);
    }
};

/// Adds the gradient of "frenet" at points 2 .. P-3; returns the energy.
template <class Real> Lanes<Real> add_frenet(const Block<Real> &b, Edges<Real> &edges) {
    Lanes<Real> energy{};
    for (int i = 2; i < b.P - 2; ++i)
        energy += Frenet<Real>(b, edges, i, Scale<Real>{}).add_gradient({}, edges.F + i - 2);
    return energy;
}

} // namespace ringlet
