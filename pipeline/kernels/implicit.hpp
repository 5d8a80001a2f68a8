// The linearly implicit step: one banded solve per strand for the velocity u at which its points travel.
//
// physics.md section 3 solves  [M (1 + theta dt c) + H] dv = dt [f + M g - c M (v - wind)] - H v / theta  with
// H = theta dt (theta dt + beta) K. We solve for u = v + theta dv, which needs no product H v:
//     [M (1 + theta dt c) + H] u = M v + theta dt [f + M (g + c wind)],      x* = x + dt u
// Everything is divided by the strand's mean mass m0. The tension T is carried: T += k_s dt d.(u_{j+1} - u_j).
// Forces, matrix and elimination are one sweep over the points from the root: see banded.hpp.
#pragma once

#include "contact.hpp"
#include "neighbours.hpp"
#include "settings.hpp"
#include "stiffness.hpp"

namespace ringlet {

/// Air drag of a point: c_perp across the strand, c_par along it [1/s] (contact.md section 2).
template <class Real> struct Drag {
    Vec3<Real> t, push; // tangent; c wind [m/s^2]
    Lanes<Real> c_perp, c_par;

    RINGLET_INLINE Drag(const Block<Real> &b, const Motion<Real> &from, int i, const StepSettings &settings,
                        Vec3<Real> wind) {
        Vec3<Real> chord = from.x[std::min(i + 1, b.P - 1)] - from.x[std::max(i - 1, 0)];
        t = inverse_root<Real>(dot(chord, chord)) * chord;
        Vec3<Real> relative = from.v[i] - wind, across = relative - dot(relative, t) * t;
        Lanes<Real> square = dot(across, across) + Real(1e-20); // of a speed that counts for nothing
        c_perp = Real(settings.drag) + Real(settings.drag_speed) * square * inverse_root<Real>(square);
        c_par = Real(settings.drag_along) * c_perp;
        Lanes<Real> along = dot(wind, t);
        push = c_perp * (wind - along * t) + (c_par * along) * t;
    }
};

/// What pulls the two ends of edge j together, elastic force and tension: minus it at its tip.
template <class Real>
RINGLET_INLINE Vec3<Real> edge_force(const Edges<Real> &edges, const Lanes<Real> *T, int j) {
    return turning(edges.D[j], edges.d[j], edges.il[j]) + T[j] * edges.d[j];
}

/// Elastic and tension forces over m0, P entries.
template <class Real>
void internal_forces(const Block<Real> &b, const StepSettings &settings, const Lanes<Real> *T, Edges<Real> &edges,
                     Vec3<Real> *f) {
    add_bending(b, edges);
    add_torsion(settings.torsion, b, edges);
    Vec3<Real> before{};
    for (int j = 0; j < b.P; ++j) {
        const Vec3<Real> now = j < b.P - 1 ? edge_force(edges, T, j) : Vec3<Real>{};
        f[j] = b.per_mass * (now - before);
        before = now;
    }
}

/// What one solve reads, and the forces: the first solve of a step fills them in.
template <class Real> struct Equation {
    const Block<Real> &b;
    const Motion<Real> &from;
    const Interval<Real> &step;
    const StepSettings &settings;
    const Contacts<Real> &contacts;
    Edges<Real> &edges;
    Vec3<Real> *f; // internal forces over m0
    const Outside<Real> *outside = nullptr; // forces of other strands
};

/// Mass, drag, the row of a contact on the diagonal, and the right side of point i.
template <class Real, class Window>
RINGLET_INLINE void add_point(const Equation<Real> &eq, int i, Window &window) {
    const Block<Real> &b = eq.b;
    const Real dt = Real(eq.step.dt), theta = Real(eq.settings.theta), theta_dt = theta * dt;
    const Vec3<Real> v = eq.from.v[i];
    const Drag<Real> drag(b, eq.from, i, eq.settings, eq.step.wind);
    Lanes<Real> block[6];
    outer(drag.t, block, theta_dt * (drag.c_par - drag.c_perp), 1 + theta_dt * drag.c_perp);
    Vec3<Real> push = eq.step.gravity + drag.push;
    if (eq.outside) {
        add_rate(*eq.outside, i, splat(theta_dt), block);
        push = push + eq.outside->push[i];
    }
    window.template add_block<0, 0>(b.mu[i], block);
    window.add_right(b.mu[i] * v + splat(theta_dt) * (eq.f[i] + b.mu[i] * push));
    if (!eq.contacts.any_row || !any<Real>(eq.contacts.row[i] > 0)) return;
    // A contact's row: theta k dt^2 n n^T with k = 1e3 / dt^2, and its right side
    const Vec3<Real> n = eq.contacts.n[i];
    const Lanes<Real> k = (theta * Real(kRow)) * eq.contacts.row[i];
    outer(n, block, k, splat(Real(0)));
    window.template add_block<0, 0>(splat(Real(1)), block);
    window.add_right((k * (dot(n, v) - eq.contacts.gap[i] / dt)) * n);
}

/// Unknowns that the terms beginning at one point reach.
template <Torsion torsion>
inline constexpr int kBand = torsion == Torsion::rotor ? 12 : torsion == Torsion::frenet ? 15 : 9;

/// The solver of one torsion model; it has memory for P points.
template <class Real, Torsion torsion> class Solver {
    using L = Lanes<Real>;
    static constexpr int Band = kBand<torsion>;

  public:
    Solver(Arena &arena, int P) : pivots_(arena.take<Pivots<Real, 3, Band>>(P)) {}

    /// Solves for u; held points know theirs. `again`: the forces are known from a solve before.
    void solve(const Equation<Real> &eq, bool again, Vec3<Real> *u) {
        const Block<Real> &b = eq.b;
        const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
        const L scale = splat(theta_dt * (theta_dt + Real(eq.settings.damping))) * b.per_mass;
        Window<Real, 3, Band> window;
        Vec3<Real> before{};
        window.clear();
        for (int i = 0; i < b.P; ++i) {
            add_terms(eq, i, !again, scale, window);
            if (!again) {
                const Vec3<Real> now = i + 1 < b.P ? edge_force(eq.edges, eq.from.T, i) : Vec3<Real>{};
                eq.f[i] = b.per_mass * (now - before);
                before = now;
            }
            const L known[3] = {u[i].x, u[i].y, u[i].z};
            if (i < b.first) {
                window.pass(known);
                continue;
            }
            add_point(eq, i, window);
            if (b.held_inside) {
                const L held = 1 - b.free[i];
                window.impose({held, held, held}, known);
            }
            window.eliminate(pivots_[i]);
        }
        L known[Band]{};
        for (int i = b.P - 1; i >= b.first; --i) {
            pivots_[i].substitute(known);
            u[i] = {known[0], known[1], known[2]};
        }
    }

  private:
    Pivots<Real, 3, Band> *pivots_;

    /// The terms that begin at point i.
    RINGLET_INLINE void add_terms(const Equation<Real> &eq, int i, bool force, L scale, Window<Real, 3, Band> &window) {
        const Block<Real> &b = eq.b;
        if (i + 2 < b.P) add_bend(b, eq.edges, i + 1, force, scale, window);
        if constexpr (torsion == Torsion::rotor)
            if (i + 3 < b.P) add_rotor(b, eq.edges, i + 1, force, scale, window);
        if constexpr (torsion == Torsion::frenet)
            if (i + 4 < b.P) add_frenet(b, eq.edges, i + 2, force, scale, window);
        if (i + 1 < b.P) add_stretch(b, eq.edges, i, eq.from.T[i], scale, Real(eq.step.dt), window);
    }
};

/// The solvers of all models, of which one has memory.
template <class Real> struct Solvers {
    Solver<Real, Torsion::none> none;
    Solver<Real, Torsion::rotor> rotor;
    Solver<Real, Torsion::frenet> frenet;

    Solvers(Arena &arena, int P, Torsion torsion)
        : none(arena, torsion == Torsion::none ? P : 0), rotor(arena, torsion == Torsion::rotor ? P : 0),
          frenet(arena, torsion == Torsion::frenet ? P : 0) {}

    void solve(const Equation<Real> &eq, bool again, Vec3<Real> *u) {
        if (eq.settings.torsion == Torsion::rotor) rotor.solve(eq, again, u);
        else if (eq.settings.torsion == Torsion::frenet) frenet.solve(eq, again, u);
        else none.solve(eq, again, u);
    }
};

/// Tensions T that the velocities u predict.
template <class Real> void predict_tensions(const Equation<Real> &eq, const Vec3<Real> *u, Lanes<Real> *T) {
    const Block<Real> &b = eq.b;
    const Real dt = Real(eq.step.dt);
    for (int j = 0; j < b.P - 1; ++j) {
        Lanes<Real> k_s = stretch_stiffness(b, eq.from.T[j], j, dt) * b.m0;
        T[j] = eq.from.T[j] + k_s * dt * dot(eq.edges.d[j], u[j + 1] - u[j]);
    }
}

} // namespace ringlet
