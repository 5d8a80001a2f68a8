// The linearly implicit step: one banded solve per strand for the velocity u at which its points travel.
//
//     [ M (1 + theta dt c) + theta dt (theta dt + beta) K + theta dt dt K_s ] u = M v + theta dt [f + M (g + c wind)]
//     x* = x + dt u,    u = v + theta dv
// K bending and torsion, beta the internal damping, K_s stretch: see stiffness.hpp. Solved for u instead of dv, the
// right side needs no product K v.
// "kirchhoff" has s = l theta of every segment as a fourth unknown of its first point: no mass, its velocity from 0.
// Everything is divided by the strand's mean mass m0. The tension T is carried: T += k_s dt d.(u_{j+1} - u_j).
// Forces, matrix and elimination are one sweep over the points from the root: see banded.hpp.
#pragma once

#include "dropped_rows.hpp"
#include "kirchhoff.hpp"
#include "neighbours.hpp"
#include "settings.hpp"
#include "stiffness.hpp"

namespace ringlet {

/// Air drag of a point: c_perp across the strand, c_par along it [1/s].
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

/// Elastic and tension forces and the load, over m0, P entries.
template <class Real>
void steady_forces(const Block<Real> &b, const StepSettings &settings, const Motion<Real> &from, const Vec3<Real> *m,
                   Edges<Real> &edges, Vec3<Real> *f) {
    edges.set(from.x, b.P);
    if (settings.torsion == Torsion::kirchhoff) {
        add_rod(b, m, from.twist, edges);
    } else {
        add_bending(b, edges);
        add_torsion(settings.torsion, b, m, edges);
    }
    Vec3<Real> before{};
    for (int j = 0; j < b.P; ++j) {
        const Vec3<Real> now = j < b.P - 1 ? edges.F[j] + from.T[j] * edges.d[j] : Vec3<Real>{};
        f[j] = b.load[j] + b.per_mass * (now - before);
        before = now;
    }
}

/// What one solve reads.
template <class Real> struct Equation {
    const Block<Real> &b;
    const Motion<Real> &from;
    const Interval<Real> &step;
    const StepSettings &settings;
    const Contacts<Real> &contacts;
    const Edges<Real> &edges;
    const Vec3<Real> *m;       // directors, where the edges are
    const Joint<Real> *joints; // of them; only "kirchhoff" has any
    const Outside<Real> *outside = nullptr; // forces of other strands
};

/// What is solved for; held points and directors know theirs.
template <class Real> struct Velocities {
    Vec3<Real> *u;
    Lanes<Real> *spin; // of s; only "kirchhoff" solves for it
};

/// Mass and drag of point i, and its right side without what the edges pull.
template <class Real>
RINGLET_INLINE void add_point(const Equation<Real> &eq, int i, Lanes<Real> (&mass)[6], Lanes<Real> (&right)[3]) {
    const Block<Real> &b = eq.b;
    const Lanes<Real> theta_dt = b.theta * Real(eq.step.dt);
    const Drag<Real> drag(b, eq.from, i, eq.settings, eq.step.wind);
    Outer<Real> own(drag.t, theta_dt * (drag.c_par - drag.c_perp), 1 + theta_dt * drag.c_perp);
    Vec3<Real> push = eq.step.gravity + drag.push;
    if (eq.outside) {
        add_rate(*eq.outside, i, theta_dt, own.entries);
        push = push + eq.outside->push[i];
    }
    for (int k = 0; k < 6; ++k) mass[k] = b.mu[i] * own.entries[k];
    const Vec3<Real> to = b.mu[i] * (eq.from.v[i] + theta_dt * push) + theta_dt * b.load[i];
    right[0] = to.x, right[1] = to.y, right[2] = to.z;
}

/// The row of a contact at point i: theta k dt^2 n n^T with k = 1e3 / dt^2, and its right side.
template <class Real>
RINGLET_INLINE void add_contact(const Equation<Real> &eq, int i, Lanes<Real> (&mass)[6], Lanes<Real> (&right)[3]) {
    if (!any<Real>(eq.contacts.row[i] > 0)) return;
    const Vec3<Real> n = eq.contacts.n[i];
    const Lanes<Real> k = (eq.b.theta * Real(kRow)) * eq.contacts.row[i];
    const Vec3<Real> to = (k * (dot(n, eq.from.v[i]) - Real(1 / eq.step.dt) * eq.contacts.gap[i])) * n;
    const Outer<Real> row(n, k, Lanes<Real>{});
    for (int e = 0; e < 6; ++e) mass[e] += row.entries[e];
    right[0] += to.x, right[1] += to.y, right[2] += to.z;
}

/// Edges that a joint of the model reaches.
template <Torsion torsion>
inline constexpr int kSpan = torsion == Torsion::rotor ? 3 : torsion == Torsion::frenet ? 4 : 2;

/// What begins at a point: bending and torsion as squares of rows g, and blocks, by the edges from there on; mass, air
/// and load. Contacts are not among it.
template <class Real, Torsion torsion> struct Terms {
    using L = Lanes<Real>;
    static constexpr int Unknowns = 3, Reach = 3 * kSpan<torsion>;
    static constexpr int Count = torsion == Torsion::rotor ? 3 : torsion == Torsion::frenet ? 2 : 1;
    static constexpr int length(int row) { return row + 1 == Count ? 6 : Reach; } // the last row is bending's

    L g[Count][Reach];
    Outer<Real> first, across; // at e_i with the stretching; at e_{i+1}, and minus between both
    L by_edge[Reach], mass[6], by_point[3];

    RINGLET_INLINE void add(int row, int column, L &sum) const {
        if (column >= 6) return;
        if (column < 3) sum += first.at(row, column);
        else sum = row < 3 ? sum - across.at(row, column - 3) : sum + across.at(row - 3, column - 3);
    }
};

template <class Real> struct Terms<Real, Torsion::kirchhoff> : RodRows<Real> {
    using L = Lanes<Real>;
    static constexpr int Unknowns = 4, Reach = RodRows<Real>::Reach;
    static constexpr int length(int) { return Reach; }

    Outer<Real> first; // at e_i
    L by_edge[Reach], mass[6], by_point[3];

    RINGLET_INLINE void add(int row, int column, L &sum) const {
        const int p = row / 4, q = column / 4;
        if (row % 4 == 3 && column % 4 == 3) sum += this->turning[p] * this->turning[q];
        if (row % 4 == 3 && row == column) sum += this->least[p];
        if (column < 3) sum += first.at(row, column);
    }
};

/// The solver of one torsion model; it has memory for P points.
template <class Real, Torsion torsion> class Solver {
    using L = Lanes<Real>;
    using M = Mask<Real>;
    using Begins = Terms<Real, torsion>;
    static constexpr bool turns = torsion == Torsion::kirchhoff;
    static constexpr int Unknowns = Begins::Unknowns, Reach = Begins::Reach, Span = kSpan<torsion>;

  public:
    Solver(Arena &arena, int P)
        : pivots_(arena.take<Pivots<Real, Unknowns, Reach>>(P)), window_(arena), dropped_(arena, P) {}

    /// Solves for the velocities of some lanes.
    void solve(const Equation<Real> &eq, M lanes, const Velocities<Real> &to) {
        const Block<Real> &b = eq.b;
        const int first = std::max(b.first - 1, 0); // the edge before the first free point
        const Scale<Real> scale = stiffness_scale(eq);
        window_.clear();
        if constexpr (torsion == Torsion::rotor)
            if (b.clamped) add_root(eq, scale, to.spin[0] * eq.edges.il[0]);
        for (int i = 0; i < b.P; ++i) {
            Begins terms;
            assemble(eq, i, scale, terms);
            if (i < first) pass(i, to, terms);
            else eliminate(eq, i, to, terms);
        }
        substitute(eq, lanes, to, [&](int i, L (&right)[Unknowns]) { std::copy_n(pivots_[i].right, Unknowns, right); });
    }

    /// Takes the rows that have been dropped out of the velocities of the last `solve` of all lanes, in some lanes.
    /// `release` counts from 1 since then.
    void drop(const Equation<Real> &eq, int release, M lanes, const Velocities<Real> &to) {
        if (release == 1) std::copy_n(to.u, eq.b.P, dropped_.solved);
        dropped_.reduce(eq.b, eq.contacts, eq.from.v, Real(eq.step.dt), release, lanes, pivots_);
        substitute(eq, lanes, to, [&](int i, L (&right)[Unknowns]) { dropped_.add(i, pivots_[i].right, right); });
    }

  private:
    Pivots<Real, Unknowns, Reach> *pivots_;
    Window<Real, Unknowns, Reach> window_;
    DroppedRows<Real, Unknowns, Reach> dropped_;

    /// Velocities in some lanes from eliminated right sides, which `right_of(i, right)` gives, from the tip to the root.
    template <class RightOf>
    RINGLET_INLINE void substitute(const Equation<Real> &eq, M lanes, const Velocities<Real> &to, RightOf right_of) {
        const Block<Real> &b = eq.b;
        L known[Reach + 3 - Unknowns]{};
        for (int i = b.P - 1; i >= std::max(b.first - 1, 0); --i) {
            L right[Unknowns];
            right_of(i, right);
            pivots_[i].substitute(right, known);
            if constexpr (turns) to.spin[i] = select<Real>(lanes, known[6], to.spin[i]);
            if (b.held_inside || i < b.first) {
                const L given[3] = {to.u[i].x, to.u[i].y, to.u[i].z};
                for (int k = 0; k < 3; ++k) known[k] = select<Real>(b.free[i] > 0, known[k], given[k]);
            }
            to.u[i] = select(lanes, Vec3<Real>{known[0], known[1], known[2]}, to.u[i]);
        }
    }

    /// Eliminates the edge at point i, with the point's contact.
    RINGLET_INLINE void eliminate(const Equation<Real> &eq, int i, const Velocities<Real> &at, const Begins &terms) {
        const Block<Real> &b = eq.b;
        L mass[6], right[3];
        for (int k = 0; k < 6; ++k) mass[k] = terms.mass[k];
        for (int k = 0; k < 3; ++k) right[k] = terms.by_point[k];
        if (eq.contacts.any_row) add_contact(eq, i, mass, right);
        if (b.held_inside || i < b.first) {
            const Vec3<Real> u = at.u[i];
            const L held = 1 - b.free[i];
            const Held<Real> known = {held, turns ? 1 - b.turns[i] : L{}, {u.x, u.y, u.z}, turns ? at.spin[i] : L{}};
            window_.eliminate_held(terms, mass, right, known, pivots_[i]);
        } else {
            window_.eliminate(terms, mass, right, pivots_[i]);
        }
    }

    /// Moves on from point i where all lanes hold it and the next one.
    void pass(int i, const Velocities<Real> &at, const Begins &terms) {
        const Vec3<Real> u = at.u[i], e = at.u[i + 1] - u;
        const L point[3] = {u.x, u.y, u.z};
        if constexpr (turns) window_.pass(terms, point, {e.x, e.y, e.z, at.spin[i]});
        else window_.pass(terms, point, {e.x, e.y, e.z});
    }

    /// theta dt (theta dt + beta) over m0, and its part without beta.
    static Scale<Real> stiffness_scale(const Equation<Real> &eq) {
        const L theta_dt = eq.b.theta * Real(eq.step.dt), damped = theta_dt + Real(eq.settings.damping);
        const L square = theta_dt * damped * eq.b.per_mass;
        return {square_root<Real>(square), 1 / square, theta_dt / damped};
    }

    /// What a gradient is in a right side.
    static L force_scale(const Equation<Real> &eq) {
        return (-Real(eq.step.dt)) * eq.b.theta * eq.b.per_mass;
    }

    /// What begins at point i, without contacts.
    RINGLET_INLINE void assemble(const Equation<Real> &eq, int i, const Scale<Real> &scale, Begins &terms) {
        const Block<Real> &b = eq.b;
        Vec3<Real> F[Span]{}; // gradient by the edges from edge i on, and by their fourth unknowns
        L F_theta[Span]{};
        if (i + 1 < b.P) {
            terms.first = stretch(b, eq.edges, i, eq.from.T[i], eq.step.dt);
            F[0] = tension(eq.edges, i, eq.from.T[i]);
        } else {
            terms.first = {};
        }
        if constexpr (turns) add_joint(eq, i, scale, F, F_theta, terms);
        else add_joints(eq, i, scale, F, terms);
        const L force = force_scale(eq);
        for (int j = 0; j < Span; ++j) {
            L *right = terms.by_edge + Unknowns * j;
            right[0] = force * F[j].x, right[1] = force * F[j].y, right[2] = force * F[j].z;
            if constexpr (turns) right[3] = i + 2 < b.P ? force * eq.edges.il[i + j] * F_theta[j] : L{};
        }
        add_point(eq, i, terms.mass, terms.by_point);
    }

    /// Bending and torsion that begin with edge i, and the stiffness by that edge.
    RINGLET_INLINE static void add_joints(const Equation<Real> &eq, int i, const Scale<Real> &scale, Vec3<Real> *F,
                                          Begins &terms) {
        const Block<Real> &b = eq.b;
        if (i + 2 < b.P) {
            Bend<Real> bend(b, eq.edges, i + 1, scale);
            bend.look_back(eq.edges, i);
            bend.add_gradient(scale, F);
            terms.across = stiffness_across(bend);
            look_back(terms.across, eq.edges, i, scale, F);
            terms.first.add(splat(Real(1)), terms.across);
            write_rows(bend, terms.g + Begins::Count - 1);
        } else { // only here: zeros are written slowly
            terms.across = {};
            for (auto &row : terms.g) std::fill(std::begin(row), std::end(row), L{});
        }
        if constexpr (torsion == Torsion::rotor)
            if (i + 3 < b.P) add_torsion(eq, i, Rotor<Real>(b, eq.edges, i + 1, scale), scale, F, terms);
        if constexpr (torsion == Torsion::frenet)
            if (i + 4 < b.P) add_torsion(eq, i, Frenet<Real>(b, eq.edges, i + 2, scale), scale, F, terms);
        if (i + Span >= b.P && i + 2 < b.P)
            for (int k = 0; k + 1 < Begins::Count; ++k) std::fill(std::begin(terms.g[k]), std::end(terms.g[k]), L{});
    }

    /// Torsion that begins with edge i.
    template <int Count, int Edges>
    RINGLET_INLINE static void add_torsion(const Equation<Real> &eq, int i, Squares<Real, Count, Edges> joint,
                                           const Scale<Real> &scale, Vec3<Real> *F, Begins &terms) {
        joint.look_back(eq.edges, i);
        joint.add_gradient(scale, F);
        write_rows(joint, terms.g);
    }

    /// "rotor" at a clamped root; its director turns at a known rate [1/s].
    void add_root(const Equation<Real> &eq, const Scale<Real> &scale, L rate) {
        RootBend<Real> root(eq.b, eq.edges, eq.m[0], scale);
        root.look_back(eq.edges, 0);
        L g[2][6];
        write_rows(root, g);
        Vec3<Real> F[2]{};
        for (int a = 0; a < 2; ++a) {
            for (int r = 0; r < 6; ++r)
                for (int c = r; c < 6; ++c) window_.left(r, c) += g[a][r] * g[a][c];
            root.r[a] += (eq.b.theta * Real(eq.step.dt) + Real(eq.settings.damping)) * root.by_theta[a] * rate;
        }
        root.add_gradient(scale, F);
        const L force = force_scale(eq);
        for (int j = 0; j < 2; ++j) {
            window_.right(3 * j) += force * F[j].x;
            window_.right(3 * j + 1) += force * F[j].y;
            window_.right(3 * j + 2) += force * F[j].z;
        }
    }

    /// The joint of "kirchhoff" that begins with edge i, and the stiffness by that edge. The last point has no edge.
    RINGLET_INLINE void add_joint(const Equation<Real> &eq, int i, const Scale<Real> &scale, Vec3<Real> *F,
                                         L *F_theta, Begins &terms) {
        const Block<Real> &b = eq.b;
        if (i + 2 < b.P) {
            const Joint<Real> q = eq.joints[i + 1];
            add_joint_gradient(Moments<Real>(b, i + 1, q), q, eq.edges, i + 1, F, F_theta);
            terms.derive(b, eq.edges, i + 1, q, scale);
            terms.look_back(eq.edges, i, scale, F, F_theta);
        } else {
            static_cast<RodRows<Real> &>(terms) = {};
        }
        terms.least[0] += splat(i + 1 == b.P ? Real(1) : Real(kLeastSpin));
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

    /// Hands the solver of the model to `use`.
    template <class Use> void with(Torsion torsion, Use use) {
        if (torsion == Torsion::kirchhoff) use(kirchhoff);
        else if (torsion == Torsion::rotor) use(rotor);
        else if (torsion == Torsion::frenet) use(frenet);
        else use(none);
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
