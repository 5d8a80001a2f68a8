// The linearly implicit step: one banded solve per strand for the velocity u at which its points travel.
//
// physics.md section 3 solves  [M (1 + theta dt c) + H] dv = dt [f + M g - c M (v - wind)] - H v / theta  with
// H = theta dt (theta dt + beta) K. We solve for u = v + theta dv, which needs no product H v:
//     [M (1 + theta dt c) + H] u = M v + theta dt [f + M (g + c wind)],      x* = x + dt u
// K = sum k_kappa dl grad(kappa) grad(kappa)^T + max(0, 1 - kappa_r/kappa) transverse bending + torsion Gauss-Newton
//     + k_s d d^T + (T/l)^+ (I - d d^T),      k_s = max(1e3 m0/dt^2, 10 T/l).
// Everything is divided by the strand's mean mass m0. The tension T is carried: T += k_s dt d.(u_{j+1} - u_j).
#pragma once

#include "banded.hpp"
#include "contact.hpp"
#include "energy.hpp"
#include "settings.hpp"

namespace ringlet {

/// Stretch stiffness k_s of segment j over m0. Stiffer than the tension, or a loaded strand goes unstable.
template <class Real>
RINGLET_INLINE Lanes<Real> stretch_stiffness(const Block<Real> &b, Lanes<Real> T, int j, Real dt) {
    return maximum<Real>(splat(Real(1e3) / (dt * dt)), 10 * T / (b.l[j] * b.m0));
}

/// w a a^T + diagonal I, as the 6 entries of a symmetric block.
template <class Real>
RINGLET_INLINE void outer(Vec3<Real> a, Lanes<Real> (&block)[6], Lanes<Real> w, Lanes<Real> diagonal) {
    block[0] = w * a.x * a.x + diagonal, block[1] = w * a.x * a.y, block[2] = w * a.x * a.z;
    block[3] = w * a.y * a.y + diagonal, block[4] = w * a.y * a.z, block[5] = w * a.z * a.z + diagonal;
}

/// Bending: the exact rank-1 term of grad(kappa), without which tight curls blow up at 2 ms, and the transverse part.
template <class Real, int Band>
void add_bending_stiffness(const Block<Real> &b, const Edges<Real> &edges, Lanes<Real> scale, Banded<Real, Band> &A) {
    const Lanes<Real> none = splat(Real(0));
    for (int i = 1; i < b.P - 1; ++i) {
        const Vec3<Real> d0 = edges.d[i - 1], d1 = edges.d[i];
        const Lanes<Real> il0 = edges.il[i - 1], il1 = edges.il[i], k = scale * b.k_kappa;
        Bend<Real> bend(d0, d1, b.dl[i], b.kappa_r[i]);
        Vec3<Real> along_c = bend.by_c * bend.c, along_e = bend.by_e * bend.e;
        Vec3<Real> g0 = turning(along_e - along_c, d0, il0), g1 = turning(along_e + along_c, d1, il1);
        const Vec3<Real> gradient[3] = {-g0, g0 - g1, g1};
        A.template add_square<3>(i - 1, gradient, k * b.dl[i]);

        Lanes<Real> block[6], open = maximum<Real>(1 - bend.ratio, none);
        outer(bend.c, block, -open / (dot(bend.c, bend.c) + Real(1e-12)), open);
        Lanes<Real> w = k * (4 / b.dl[i]) * bend.inverse_ee * il0 * il1;
        A.add_block(i - 1, i - 1, w, block);
        A.add_block(i - 1, i, -2 * w, block);
        A.add_block(i - 1, i + 1, w, block);
        A.add_block(i, i, 4 * w, block);
        A.add_block(i, i + 1, -2 * w, block);
        A.add_block(i + 1, i + 1, w, block);
    }
}

/// Two unit vectors that make an orthonormal basis with d ("Building an orthonormal basis, revisited", Duff et al. 2017).
template <class Real> RINGLET_INLINE void complete_basis(Vec3<Real> d, Vec3<Real> (&m)[2]) {
    Lanes<Real> sign = d.z >= 0 ? splat(Real(1)) : splat(Real(-1));
    Lanes<Real> a = -1 / (sign + d.z), xy = d.x * d.y * a;
    m[0] = {1 + sign * d.x * d.x * a, sign * xy, -sign * d.x};
    m[1] = {xy, sign + d.y * d.y * a, -d.y};
}

/// "rotor": its energy is G/2 |r|^2 with r = sqrt(rho) R beta_i - beta_{i+1} / sqrt(rho) across edge i; two rows m.r.
template <class Real, int Band>
void add_rotor_stiffness(const Block<Real> &b, const Edges<Real> &edges, Lanes<Real> scale, Banded<Real, Band> &A) {
    for (int i = 1; i < b.P - 2; ++i) {
        const Vec3<Real> *d = edges.d + i - 1;
        const Lanes<Real> *il = edges.il + i - 1;
        Vec3<Real> basis[2];
        complete_basis(d[1], basis);
        const Lanes<Real> root = square_root<Real>(b.rho[i]), inverse = 1 / root;
        for (const Vec3<Real> &m : basis) {
            Vec3<Real> turned = root * (b.C[i] * m - b.S[i] * cross(d[1], m)); // sqrt(rho) R^T m
            Vec3<Real> g0 = turning(cross(d[1], turned), d[0], il[0]);
            Vec3<Real> g1 = turning(cross(turned, d[0]) - inverse * cross(d[2], m), d[1], il[1]);
            Vec3<Real> g2 = turning(-inverse * cross(m, d[1]), d[2], il[2]);
            const Vec3<Real> gradient[4] = {-g0, g0 - g1, g1 - g2, g2};
            A.template add_square<4>(i - 1, gradient, scale * b.G[i]);
        }
    }
}

/// "frenet": Gauss-Newton, one row of five points.
template <class Real, int Band>
void add_frenet_stiffness(const Block<Real> &b, const Edges<Real> &edges, Lanes<Real> scale, Banded<Real, Band> &A) {
    for (int i = 2; i < b.P - 2; ++i) {
        FrenetTorsion<Real> torsion(b, edges, i);
        Vec3<Real> gradient[5], before{};
        for (int k = 0; k < 4; ++k) {
            Vec3<Real> g = turning(torsion.by_d[k], edges.d[i - 2 + k], edges.il[i - 2 + k]);
            gradient[k] = before - g;
            before = g;
        }
        gradient[4] = before;
        A.template add_square<5>(i - 2, gradient, scale * b.k_tau * b.dl[i]);
    }
}

template <class Real, int Band>
void add_stretch_stiffness(const Block<Real> &b, const Edges<Real> &edges, const Lanes<Real> *T, Lanes<Real> scale,
                           Real dt, Banded<Real, Band> &A) {
    for (int j = 0; j < b.P - 1; ++j) {
        Lanes<Real> block[6], tight = maximum<Real>(T[j], splat(Real(0))) * edges.il[j] / b.m0;
        outer(edges.d[j], block, stretch_stiffness(b, T[j], j, dt) - tight, tight);
        Lanes<Real> w = scale * b.m0;
        A.add_block(j, j, w, block);
        A.add_block(j, j + 1, -w, block);
        A.add_block(j + 1, j + 1, w, block);
    }
}

/// Air drag of a point: c_perp across the strand, c_par along it [1/s] (contact.md section 2).
template <class Real> struct Drag {
    Vec3<Real> t, push; // tangent; c wind [m/s^2]
    Lanes<Real> c_perp, c_par;

    Drag(const Block<Real> &b, const Motion<Real> &from, int i, const StepSettings &settings, Vec3<Real> wind) {
        Vec3<Real> chord = from.x[std::min(i + 1, b.P - 1)] - from.x[std::max(i - 1, 0)];
        t = (1 / square_root<Real>(dot(chord, chord))) * chord;
        Vec3<Real> relative = from.v[i] - wind, across = relative - dot(relative, t) * t;
        c_perp = Real(settings.drag) + Real(settings.drag_speed) * square_root<Real>(dot(across, across));
        c_par = Real(settings.drag_along) * c_perp;
        Lanes<Real> along = dot(wind, t);
        push = c_perp * (wind - along * t) + (c_par * along) * t;
    }
};

/// Elastic and tension forces over m0, P entries.
template <class Real>
void internal_forces(const Block<Real> &b, const StepSettings &settings, const Lanes<Real> *T, Edges<Real> &edges,
                     Vec3<Real> *f) {
    for (int i = 0; i < b.P; ++i) f[i] = Vec3<Real>{};
    add_bending(b, edges);
    add_torsion(settings.torsion, b, edges);
    add_edge_forces(edges, b.P, f);
    const Lanes<Real> per_mass = 1 / b.m0;
    for (int j = 0; j < b.P - 1; ++j) {
        f[j] = f[j] + T[j] * edges.d[j];
        f[j + 1] = f[j + 1] - T[j] * edges.d[j];
        f[j] = per_mass * f[j];
    }
    f[b.P - 1] = per_mass * f[b.P - 1];
}

/// What one solve reads.
template <class Real> struct Equation {
    const Block<Real> &b;
    const Motion<Real> &from;
    const Interval<Real> &step;
    const StepSettings &settings;
    const Contacts<Real> &contacts;
    const Edges<Real> &edges;
    const Vec3<Real> *f; // internal forces over m0
};

/// Masses, drag, rows of contacts on the diagonal, and the right side.
template <class Real, int Band> void add_points(const Equation<Real> &eq, Banded<Real, Band> &A) {
    const Block<Real> &b = eq.b;
    const Real dt = Real(eq.step.dt), theta = Real(eq.settings.theta), theta_dt = theta * dt;
    const Lanes<Real> one = splat(Real(1));
    for (int i = b.first; i < b.P; ++i) {
        const Vec3<Real> v = eq.from.v[i];
        Drag<Real> drag(b, eq.from, i, eq.settings, eq.step.wind);
        Lanes<Real> block[6];
        outer(drag.t, block, theta_dt * (drag.c_par - drag.c_perp), 1 + theta_dt * drag.c_perp);
        A.add_block(i, i, b.mu[i], block);
        A.add_right(i, b.mu[i] * v + splat(theta_dt) * (eq.f[i] + b.mu[i] * (eq.step.gravity + drag.push)));
        if (!eq.contacts.any_row || !any<Real>(eq.contacts.row[i] > 0)) continue;
        // A contact's row: theta k dt^2 n n^T with k = 1e3 / dt^2, and its right side
        const Vec3<Real> n = eq.contacts.n[i];
        Lanes<Real> k = (theta * Real(kRow)) * eq.contacts.row[i];
        outer(n, block, k, splat(Real(0)));
        A.add_block(i, i, one, block);
        A.add_right(i, (k * (dot(n, v) - eq.contacts.gap[i] / dt)) * n);
    }
}

/// Puts the known velocities of held points into the system.
template <class Real, int Band>
void hold(const Block<Real> &b, const Vec3<Real> *u, Banded<Real, Band> &A) {
    for (int i = 0; i < b.first; ++i) {
        const Lanes<Real> known[3] = {u[i].x, u[i].y, u[i].z};
        for (int a = 0; a < 3; ++a)
            for (int k = 1; k < Band; ++k) A.right[3 * i + a + k] -= A.row(3 * i + a)[k] * known[a];
    }
    if (!b.held_inside) return;
    for (int i = b.first; i < b.P; ++i)
        if (any<Real>(b.free[i] < 1)) A.eliminate(i, 1 - b.free[i], u[i]);
}

/// Solves for u (held points know theirs) and predicts the tensions T from the stretch.
template <class Real, int Band>
void solve_velocities(const Equation<Real> &eq, Banded<Real, Band> &A, Vec3<Real> *u, Lanes<Real> *T) {
    const Block<Real> &b = eq.b;
    const Real dt = Real(eq.step.dt), theta_dt = Real(eq.settings.theta) * dt;
    const Lanes<Real> scale = splat(theta_dt * (theta_dt + Real(eq.settings.damping))) / b.m0;
    A.clear();
    add_bending_stiffness(b, eq.edges, scale, A);
    if constexpr (Band >= 15) {
        if (eq.settings.torsion == Torsion::frenet) add_frenet_stiffness(b, eq.edges, scale, A);
    }
    if (eq.settings.torsion == Torsion::rotor) add_rotor_stiffness(b, eq.edges, scale, A);
    add_stretch_stiffness(b, eq.edges, eq.from.T, scale, dt, A);
    add_points(eq, A);
    hold(b, u, A);
    A.solve(3 * b.first);
    for (int i = b.first; i < b.P; ++i) u[i] = {A.right[3 * i], A.right[3 * i + 1], A.right[3 * i + 2]};
    for (int j = 0; j < b.P - 1; ++j) {
        Lanes<Real> k_s = stretch_stiffness(b, eq.from.T[j], j, dt) * b.m0;
        T[j] = eq.from.T[j] + k_s * dt * dot(eq.edges.d[j], u[j + 1] - u[j]);
    }
}

} // namespace ringlet
