// The linearly implicit step: one banded solve per strand for the velocity u at which its points travel.
//
// physics.md section 3 solves  [M (1 + theta dt c) + H] dv = dt [f + M g - c M (v - wind)] - H v / theta  with
// H = theta dt (theta dt + beta) K. We solve for u = v + theta dv, which needs no product H v:
//     [M (1 + theta dt c) + H] u = M v + theta dt [f + M (g + c wind)],      x* = x + dt u
// "kirchhoff" has s = l theta of every segment as a fourth unknown of its first point: no mass, its velocity from 0.
// Everything is divided by the strand's mean mass m0. The tension T is carried: T += k_s dt d.(u_{j+1} - u_j).
// Forces, matrix and elimination are one sweep over the points from the root: see banded.hpp.
#pragma once

#include "contact.hpp"
#include "kirchhoff.hpp"
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

/// Elastic and tension forces and the load, over m0, P entries.
template <class Real>
void steady_forces(const Block<Real> &b, const StepSettings &settings, const Motion<Real> &from, Edges<Real> &edges,
                   Vec3<Real> *f) {
    if (settings.torsion == Torsion::kirchhoff) {
        add_rod(b, from.m, from.twist, edges);
    } else {
        add_bending(b, edges);
        add_torsion(settings.torsion, b, from.m, edges);
    }
    Vec3<Real> before{};
    for (int j = 0; j < b.P; ++j) {
        const Vec3<Real> now = j < b.P - 1 ? edge_force(edges, from.T, j) : Vec3<Real>{};
        f[j] = b.load[j] + b.per_mass * (now - before);
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
    Vec3<Real> *f; // steady forces over m0
    const Outside<Real> *outside = nullptr; // forces of other strands
};

/// What is solved for; held points and directors know theirs.
template <class Real> struct Velocities {
    Vec3<Real> *u;
    Lanes<Real> *spin; // of s; only "kirchhoff" solves for it
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
inline constexpr int kBand = torsion == Torsion::rotor       ? 12
                             : torsion == Torsion::frenet    ? 15
                             : torsion == Torsion::kirchhoff ? 11
                                                             : 9;

/// The solver of one torsion model; it has memory for P points.
template <class Real, Torsion torsion> class Solver {
    using L = Lanes<Real>;
    static constexpr bool turns = torsion == Torsion::kirchhoff;
    static constexpr int Unknowns = turns ? 4 : 3, Band = kBand<torsion>;
    using System = Window<Real, Unknowns, Band>;

  public:
    Solver(Arena &arena, int P) : pivots_(arena.take<Pivots<Real, Unknowns, Band>>(P)) {}

    /// Solves for the velocities. `again`: the forces are known from a solve before.
    void solve(const Equation<Real> &eq, bool again, const Velocities<Real> &to) {
        const Block<Real> &b = eq.b;
        const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
        const L scale = splat(theta_dt * (theta_dt + Real(eq.settings.damping))) * b.per_mass;
        const int first = turns ? std::max(b.first - 1, 0) : b.first; // segment first - 1 turns
        System window;
        Vec3<Real> before{};
        window.clear();
        for (int i = 0; i < b.P; ++i) {
            add_terms(eq, i, !again, scale, window);
            if constexpr (torsion == Torsion::rotor)
                if (i == 0 && b.clamped)
                    add_root(b, eq.edges, eq.from.m[0], to.spin[0] * eq.edges.il[0], !again, scale, window);
            if (!again) {
                const Vec3<Real> now = i + 1 < b.P ? edge_force(eq.edges, eq.from.T, i) : Vec3<Real>{};
                eq.f[i] = b.load[i] + b.per_mass * (now - before);
                before = now;
            }
            const Values known = known_at(i, to);
            if (i < first) {
                window.pass(known.value);
                continue;
            }
            add_point(eq, i, window);
            if constexpr (turns) add_turn(eq, i, window);
            if (b.held_inside || i < b.first) window.impose(held_at(b, i).value, known.value);
            window.eliminate(pivots_[i]);
        }
        L known[Band]{};
        for (int i = b.P - 1; i >= first; --i) {
            pivots_[i].substitute(known);
            to.u[i] = {known[0], known[1], known[2]};
            if constexpr (turns) to.spin[i] = known[3];
        }
    }

  private:
    struct Values {
        L value[Unknowns];
    };

    Pivots<Real, Unknowns, Band> *pivots_;

    RINGLET_INLINE static Values known_at(int i, const Velocities<Real> &at) {
        if constexpr (turns) return {{at.u[i].x, at.u[i].y, at.u[i].z, at.spin[i]}};
        else return {{at.u[i].x, at.u[i].y, at.u[i].z}};
    }

    RINGLET_INLINE static Values held_at(const Block<Real> &b, int i) {
        const L held = 1 - b.free[i];
        if constexpr (turns) return {{held, held, held, 1 - b.turns[i]}};
        else return {{held, held, held}};
    }

    /// The row of s of segment i; the last point has no segment.
    RINGLET_INLINE static void add_turn(const Equation<Real> &eq, int i, System &window) {
        window.at(3, 3) += splat(i + 1 < eq.b.P ? Real(kSpin) : Real(1));
        if (i + 1 == eq.b.P) return;
        const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
        window.right[3] -= theta_dt * eq.b.per_mass * eq.edges.il[i] * eq.edges.D_theta[i];
    }

    /// The terms that begin at point i.
    RINGLET_INLINE void add_terms(const Equation<Real> &eq, int i, bool force, L scale, System &window) {
        const Block<Real> &b = eq.b;
        if constexpr (turns) {
            if (i + 2 < b.P) add_joint(b, eq.from, eq.edges, i + 1, force, scale, window);
        } else {
            if (i + 2 < b.P) add_bend(b, eq.edges, i + 1, force, scale, window);
        }
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
    Solver<Real, Torsion::kirchhoff> kirchhoff;

    Solvers(Arena &arena, int P, Torsion torsion)
        : none(arena, torsion == Torsion::none ? P : 0), rotor(arena, torsion == Torsion::rotor ? P : 0),
          frenet(arena, torsion == Torsion::frenet ? P : 0), kirchhoff(arena, torsion == Torsion::kirchhoff ? P : 0) {}

    void solve(const Equation<Real> &eq, bool again, const Velocities<Real> &to) {
        if (eq.settings.torsion == Torsion::kirchhoff) kirchhoff.solve(eq, again, to);
        else if (eq.settings.torsion == Torsion::rotor) rotor.solve(eq, again, to);
        else if (eq.settings.torsion == Torsion::frenet) frenet.solve(eq, again, to);
        else none.solve(eq, again, to);
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
