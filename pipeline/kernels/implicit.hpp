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

#include "contact.hpp"
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
void steady_forces(const Block<Real> &b, const StepSettings &settings, const Motion<Real> &from, Edges<Real> &edges,
                   Vec3<Real> *f) {
    edges.set(from.x, b.P);
    if (settings.torsion == Torsion::kirchhoff) {
        add_rod(b, from.m, from.twist, edges);
    } else {
        add_bending(b, edges);
        add_torsion(settings.torsion, b, from.m, edges);
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
    const Vec3<Real> *m; // directors, where the edges are
    const Outside<Real> *outside = nullptr; // forces of other strands
};

/// What is solved for; held points and directors know theirs.
template <class Real> struct Velocities {
    Vec3<Real> *u;
    Lanes<Real> *spin; // of s; only "kirchhoff" solves for it
};

/// Mass and drag of point i, and the right side; `pull` is what the edges beside it pull, over m0.
template <class Real, class Rows>
RINGLET_INLINE void add_point(const Equation<Real> &eq, int i, Vec3<Real> pull, Rows &rows) {
    const Block<Real> &b = eq.b;
    const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
    const Drag<Real> drag(b, eq.from, i, eq.settings, eq.step.wind);
    Outer<Real> block(drag.t, theta_dt * (drag.c_par - drag.c_perp), 1 + theta_dt * drag.c_perp);
    Vec3<Real> push = eq.step.gravity + drag.push;
    if (eq.outside) {
        add_rate(*eq.outside, i, splat(theta_dt), block.entries);
        push = push + eq.outside->push[i];
    }
    for (int r = 0; r < 3; ++r)
        for (int c = r; c < 3; ++c) rows.entries[r][c] += b.mu[i] * block.at(r, c);
    const Vec3<Real> right = b.mu[i] * (eq.from.v[i] + splat(theta_dt) * push) + splat(theta_dt) * (pull + b.load[i]);
    rows.right[0] = right.x, rows.right[1] = right.y, rows.right[2] = right.z;
}

/// The row of a contact at point i: theta k dt^2 n n^T with k = 1e3 / dt^2, and its right side.
template <class Real, class Window> RINGLET_INLINE void add_contact(const Equation<Real> &eq, int i, Window &window) {
    if (!any<Real>(eq.contacts.row[i] > 0)) return;
    const Vec3<Real> n = eq.contacts.n[i];
    const Lanes<Real> k = (Real(eq.settings.theta) * Real(kRow)) * eq.contacts.row[i];
    window.add_row(n, k, dot(n, eq.from.v[i]) - Real(1 / eq.step.dt) * eq.contacts.gap[i]);
}

/// Edges that a joint of the model reaches.
template <Torsion torsion>
inline constexpr int kSpan = torsion == Torsion::rotor ? 3 : torsion == Torsion::frenet ? 4 : 2;

/// The solver of one torsion model; it has memory for P points.
template <class Real, Torsion torsion> class Solver {
    using L = Lanes<Real>;
    static constexpr bool turns = torsion == Torsion::kirchhoff;
    static constexpr int Unknowns = turns ? 4 : 3;
    using System = Assembly<Real, Unknowns, kSpan<torsion>>;
    static constexpr int Band = System::Band, Reach = System::Reach;
    using PointRows = Rows<Real, Unknowns, Band>;

  public:
    Solver(Arena &arena, int P)
        : kept_(arena.take<PointRows>(P)), pivots_(arena.take<Pivots<Real, Unknowns, Band>>(P)) {}

    /// Solves for the velocities. `again`: as before but for the rows of contacts. To keep the rows for that costs a
    /// tenth of a solve, so they are kept only after a step that has solved again; else they are assembled again.
    void solve(const Equation<Real> &eq, bool again, const Velocities<Real> &to) {
        if (!again) keeps_ = eq.contacts.any_row && solved_again_;
        solved_again_ = again;
        const Block<Real> &b = eq.b;
        const int first = turns ? std::max(b.first - 1, 0) : b.first; // segment first - 1 turns
        const Scale<Real> scale = stiffness_scale(eq);
        System assembly;
        Window<Real, Unknowns, Band> window;
        for (int i = 0; i < b.P; ++i) {
            if (again && keeps_) {
                window.rows = kept_[i];
            } else {
                assemble(eq, i, scale, to, assembly, window.rows);
                if (keeps_) kept_[i] = window.rows;
            }
            const Values known = known_at(i, to);
            if (i < first) {
                window.pass(known.value);
                continue;
            }
            if (eq.contacts.any_row) add_contact(eq, i, window);
            window.complete();
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

    PointRows *kept_; // rows without contacts
    bool keeps_ = false, solved_again_ = false;
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

    /// theta dt (theta dt + beta) over m0, and its part without beta.
    static Scale<Real> stiffness_scale(const Equation<Real> &eq) {
        const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
        const L square = splat(theta_dt * (theta_dt + Real(eq.settings.damping))) * eq.b.per_mass;
        return {square_root<Real>(square), 1 / square, theta_dt / (theta_dt + Real(eq.settings.damping))};
    }

    /// The rows of point i without contacts.
    RINGLET_INLINE static void assemble(const Equation<Real> &eq, int i, const Scale<Real> &scale,
                                        const Velocities<Real> &known, System &assembly, PointRows &rows) {
        const Block<Real> &b = eq.b;
        assembly.open();
        Outer<Real> stretching;
        if (i + 1 < b.P) {
            stretching = stretch(b, eq.edges, i, eq.from.T[i], eq.step.dt, eq.settings.theta);
            assembly.edge(0) = assembly.edge(0) + tension(eq.edges, i, eq.from.T[i]);
        }
        if constexpr (turns) add_joint(eq, i, scale, stretching, assembly);
        else add_joints(eq, i, scale, stretching, assembly);
        if constexpr (torsion == Torsion::rotor)
            if (i == 0 && b.clamped) add_root(eq, scale, known.spin[0] * eq.edges.il[0], assembly);
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; ++a) assembly.row(a, rows.entries[a]);
        add_point(eq, i, b.per_mass * assembly.pull(), rows);
        if constexpr (turns) add_turn(eq, i, assembly.fourth(0), rows);
    }

    /// The row of s of segment i; the last point has no segment.
    RINGLET_INLINE static void add_turn(const Equation<Real> &eq, int i, L F_theta, PointRows &rows) {
        const Real theta_dt = Real(eq.settings.theta) * Real(eq.step.dt);
        const bool is_last = i + 1 == eq.b.P;
        rows.entries[3][3] += splat(is_last ? Real(1) : Real(kLeastSpin));
        rows.right[3] = is_last ? L{} : -theta_dt * eq.b.per_mass * eq.edges.il[i] * F_theta;
    }

    /// Bending and torsion that begin with edge i, and the stiffness by that edge.
    RINGLET_INLINE static void add_joints(const Equation<Real> &eq, int i, const Scale<Real> &scale,
                                          const Outer<Real> &stretching, System &assembly) {
        const Block<Real> &b = eq.b;
        BendStiffness<Real> bending;
        if (i + 2 < b.P) {
            Bend<Real> bend(b, eq.edges, i + 1, scale);
            bend.look_back(eq.edges, i);
            bend.add_gradient(scale, &assembly.edge(0));
            bending = BendStiffness<Real>(bend);
            bending.look_back(eq.edges, i, scale, &assembly.edge(0));
        }
        L g[torsion == Torsion::rotor ? 2 : 1][Reach]{};
        if constexpr (torsion == Torsion::rotor)
            if (i + 3 < b.P) add_rows(eq, i, Rotor<Real>(b, eq.edges, i + 1, scale), scale, assembly, g);
        if constexpr (torsion == Torsion::frenet)
            if (i + 4 < b.P) add_rows(eq, i, Frenet<Real>(b, eq.edges, i + 2, scale), scale, assembly, g);
        assembly.fill(g, [&](int row, int column, L &sum) RINGLET_ALWAYS {
            bending.add(row, column, sum);
            if (column < 3) sum += stretching.at(row, column);
        });
    }

    template <int Count, int Edges>
    RINGLET_INLINE static void add_rows(const Equation<Real> &eq, int i, Squares<Real, Count, Edges> joint,
                                        const Scale<Real> &scale, System &assembly, L (&g)[Count][Reach]) {
        joint.look_back(eq.edges, i);
        joint.add_gradient(scale, &assembly.edge(0));
        write_rows(joint, g);
    }

    /// "rotor" at a clamped root; its director turns at a known rate [1/s].
    RINGLET_INLINE static void add_root(const Equation<Real> &eq, const Scale<Real> &scale, L rate, System &assembly) {
        RootBend<Real> root(eq.b, eq.edges, eq.m[0], scale);
        root.look_back(eq.edges, 0);
        L g[2][6];
        write_rows(root, g);
        for (int a = 0; a < 2; ++a) {
            for (int r = 0; r < 6; ++r)
                for (int c = r; c < 6; ++c) assembly.at(r, c) += g[a][r] * g[a][c];
            root.r[a] += Real(eq.settings.theta * eq.step.dt + eq.settings.damping) * root.by_theta[a] * rate;
        }
        root.add_gradient(scale, &assembly.edge(0));
    }

    /// The joint of "kirchhoff" that begins with edge i, and the stiffness by that edge.
    RINGLET_INLINE static void add_joint(const Equation<Real> &eq, int i, const Scale<Real> &scale,
                                         const Outer<Real> &stretching, System &assembly) {
        const Block<Real> &b = eq.b;
        RodRows<Real> rows{};
        if (i + 2 < b.P) {
            const Joint<Real> q(eq.edges.d[i], eq.edges.d[i + 1], eq.m[i], eq.m[i + 1], eq.from.twist[i + 1]);
            add_joint_gradient(Moments<Real>(b, i + 1, q), q, eq.edges, i + 1, &assembly.edge(0), &assembly.fourth(0));
            rows = RodRows<Real>(b, eq.edges, i + 1, q, scale);
            rows.look_back(eq.edges, i, scale, &assembly.edge(0), &assembly.fourth(0));
        }
        assembly.fill(rows.row, [&](int row, int column, L &sum) RINGLET_ALWAYS {
            if (row % 4 == 3 && column % 4 == 3) sum += rows.turning[row / 4] * rows.turning[column / 4];
            if (row % 4 == 3 && column == row) sum += rows.least[row / 4];
            if (column < 3) sum += stretching.at(row, column);
        });
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
