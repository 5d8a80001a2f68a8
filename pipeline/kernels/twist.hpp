// Directors of "kirchhoff" strands: how they start, follow the points through a step, and find their twist.
//
// Notation as in kirchhoff.hpp: t_j tangent of segment j, m_j its director, theta_j a turn of it about t_j.
// A step takes a director along by parallel transport in time (the smallest turn from the old tangent to the new one),
// turns it as the solve predicts, and then takes one Newton step towards the quasi-static twist, dE/dtheta = 0 for every
// free director: a tridiagonal system per strand. Its matrix is the exact one, but for the part g of bending in it,
// which counts where it is positive:
//     diagonal += (C + g) / dl at both segments of a joint, beside it (g - C) / dl
// Source: Bergou et al., "Discrete elastic rods" (2008), sections 4.2 and 5 (quasi-static material frame);
// "Discrete viscous threads" (2010), section 3 (parallel transport in time). We differ in taking one step, not
// iterating: what is left over acts in the next time step (statics: test_an_equilibrium_is_one_for_every_dt).
#pragma once

#include "kirchhoff.hpp"
#include "settings.hpp"

namespace ringlet {

inline constexpr double kMostTurn = 0.8;       // [rad] of a director in one step, each of predictor and Newton step
inline constexpr double kNoStiffness = 1e-25;  // [N m] far below any hair's, for strands without

/// m turned as the tangent t turns into u on the shortest way.
template <class Real> RINGLET_INLINE Vec3<Real> transport(Vec3<Real> m, Vec3<Real> t, Vec3<Real> u) {
    Lanes<Real> opened = maximum<Real>(1 + dot(t, u), splat(kFold<Real>));
    return m - (dot(m, u) * reciprocal<Real>(opened)) * (t + u);
}

/// A director for a tangent: square to the first of two fixed axes that is not too near. They are skew to x, y and z,
/// where many strands point, so that rounding does not decide between them.
template <class Real> RINGLET_INLINE Vec3<Real> some_director(Vec3<Real> t) {
    const Vec3<Real> first = {splat(Real(0.36)), splat(Real(0.48)), splat(Real(0.8))};
    const Vec3<Real> second = {splat(Real(0.8)), splat(Real(-0.6)), splat(Real(0))};
    const Lanes<Real> along = dot(first, t);
    const Vec3<Real> axis = select((along < Real(0.9)) & (along > Real(-0.9)), first, second);
    const Vec3<Real> m = axis - dot(axis, t) * t;
    return inverse_root<Real>(dot(m, m)) * m;
}

/// The unit director nearest to m that is square to the unit tangent t; m is nearly that already.
template <class Real> RINGLET_INLINE Vec3<Real> squared(Vec3<Real> m, Vec3<Real> t) {
    m = m - dot(m, t) * t;
    const Lanes<Real> mm = dot(m, m), off = maximum<Real>(mm - 1, 1 - mm);
    Vec3<Real> unit = (Real(1.5) - Real(0.5) * mm) * m;
    const Mask<Real> far = ~(off < Real(1e-4));
    if (!any<Real>(far)) return unit;
    unit = select(far, inverse_root<Real>(maximum<Real>(mm, splat(Real(1e-4)))) * m, unit);
    return select(~(mm > Real(1e-4)), some_director(t), unit);
}

/// m turned about t by the angle 2 arctan(u).
template <class Real> RINGLET_INLINE Vec3<Real> turned(Vec3<Real> m, Vec3<Real> t, Lanes<Real> u) {
    const Lanes<Real> uu = u * u, scale = reciprocal<Real>(1 + uu);
    return ((1 - uu) * scale) * m + (2 * u * scale) * cross(t, m);
}

/// Half of an angle, no larger than half the most that a director turns.
template <class Real> RINGLET_INLINE Lanes<Real> half_turn(Lanes<Real> angle) {
    const Lanes<Real> most = splat(Real(0.5 * kMostTurn));
    return minimum<Real>(maximum<Real>(Real(0.5) * angle, -most), most);
}

/// Directors without twist along the points x (Bishop frame), P - 1 entries, from `some_director` at the root.
template <class Real> void untwisted_directors(const Edges<Real> &edges, int P, Vec3<Real> *m) {
    m[0] = some_director(edges.d[0]);
    for (int j = 1; j < P - 1; ++j) m[j] = squared(transport(m[j - 1], edges.d[j - 1], edges.d[j]), edges.d[j]);
}

/// The same for S strands of P points (S, P, 3), in float64: directors (S, P-1, 3).
template <class Real> void untwisted_directors(const Real *points, int S, int P, Real *directors) {
    Arena arena(sizeof(Lanes<double>) * 16 * (P + 8));
    Edges<double> edges(arena, P);
    auto *x = arena.take<Vec3<double>>(P), *m = arena.take<Vec3<double>>(P);
    for (int k = 0; k < block_count<double>(S); ++k) {
        const BlockIndex<double> index(k, S);
        gather(x, points, P, index.strand);
        edges.set(x, P);
        untwisted_directors(edges, P, m);
        scatter(m, directors, P - 1, index);
    }
}

/// Takes the directors of a block through steps. Memory of one step.
template <class Real> class Directors {
    using L = Lanes<Real>;

  public:
    L *spin; // velocity of s = l theta: known for held directors, else from the solve

    Directors(Arena &arena, int P)
        : spin(arena.take<L>(P)), t_(arena.take<Vec3<Real>>(P)), joints_(arena.take<Joint<Real>>(P)) {
        for (auto **array : {&inverse_, &upper_, &right_}) *array = arena.take<L>(P);
    }

    /// A director is held where both ends of its segment are, and goes rigidly with them: the directors of held
    /// segments at the end of the step, and their spin. `start` are the directors of the edges.
    void hold(const Block<Real> &b, const Edges<Real> &edges, const Vec3<Real> *start, const Interval<Real> &interval,
              const Motion<Real> &from, Motion<Real> &to) {
        const Rigid<Real> head(interval.poses.head[1]), hand(interval.poses.hand[1]);
        const Real dt = Real(interval.dt);
        for (int j = 0; j < b.P - 1; ++j) {
            spin[j] = L{};
            to.m[j] = from.m[j];
            if (!any<Real>(b.turns[j] < 1)) continue;
            const Vec3<Real> edge = to.x[j + 1] - to.x[j], t = inverse_root<Real>(dot(edge, edge)) * edge;
            const Vec3<Real> by_head = head.turn(interval.skin.turn(b.director[j])), by_hand = hand.turn(b.director[j]);
            const Vec3<Real> m = squared(select(b.hand[j] > 0, by_hand, by_head), t);
            const Vec3<Real> before = squared(transport(start[j], edges.d[j], t), t);
            const HalfAngle<Real> half(dot(before, m), dot(cross(before, m), t));
            to.m[j] = select(b.turns[j] > 0, to.m[j], m);
            spin[j] = (1 - b.turns[j]) * half.angle / (dt * edges.il[j]);
        }
    }

    /// Free directors at the end of the step, and the twist of all joints. `start` are the directors of the edges.
    void follow(const Block<Real> &b, const Edges<Real> &edges, const Vec3<Real> *start, Real dt,
                const Motion<Real> &from, Motion<Real> &to) {
        for (int j = 0; j < b.P - 1; ++j) {
            const Vec3<Real> edge = to.x[j + 1] - to.x[j], t = inverse_root<Real>(dot(edge, edge)) * edge;
            const Vec3<Real> m = squared(transport(start[j], edges.d[j], t), t);
            const L ahead = edges.ahead ? edges.ahead_s[j] : L{};
            to.m[j] = select(b.turns[j] > 0, turned(m, t, half_turn<Real>(edges.il[j] * (dt * spin[j] - ahead))), to.m[j]);
            t_[j] = t;
            to.twist[j] = from.twist[j];
        }
        relax(b, t_, to.m, to.twist, nullptr);
    }

    /// The directors of lanes whose strand only moved on: they keep their directors.
    void carry(const Block<Real> &b, const Motion<Real> &from, Motion<Real> &to, Mask<Real> lanes) {
        for (int j = 0; j < b.P - 1; ++j) {
            const Vec3<Real> edge = to.x[j + 1] - to.x[j];
            t_[j] = inverse_root<Real>(dot(edge, edge)) * edge;
            to.m[j] = select(lanes & (b.turns[j] > 0), from.m[j], to.m[j]);
            if (j == 0) continue;
            const Joint<Real> q(t_[j - 1], t_[j], to.m[j - 1], to.m[j], from.twist[j]);
            to.twist[j] = select<Real>(lanes, q.twist, to.twist[j]);
        }
    }

    /// One Newton step of dE/dtheta = 0 for directors m at the tangents t; `twist` comes in as that before, and `by`,
    /// unless null, tells how far directors have turned.
    void relax(const Block<Real> &b, const Vec3<Real> *t, Vec3<Real> *m, L *twist, L *by) {
        const L none = splat(Real(0)), one = splat(Real(1));
        // Joints for themselves: each is a long chain of operations, and many of them go side by side
        for (int i = 1; i < b.P - 1; ++i) joints_[i] = Joint<Real>(t[i - 1], t[i], m[i - 1], m[i], twist[i]);
        L diagonal = none, force = none, coupling = none; // of segment j: from the joint before it
        for (int j = 0; j < b.P - 1; ++j) {
            L next_diagonal = none, next_force = none, next_coupling = none;
            if (j + 1 < b.P - 1) {
                const int i = j + 1;
                const Joint<Real> &q = joints_[i];
                const Moments<Real> at(b, i, q);
                const L both = Real(0.5) * (at.M1 * q.k2 - at.M2 * q.k1), per_length = b.inverse_dl[i];
                const L g = Real(0.25) * maximum<Real>(turning_stiffness(b, i, q), none);
                next_diagonal = per_length * (b.k_tau + g + kLeastTwisting<Real> * (b.k_kappa + b.k_tau)) + Real(kNoStiffness);
                next_coupling = per_length * (g - b.k_tau) * b.turns[j] * b.turns[i];
                next_force = -both - at.Q;
                diagonal += next_diagonal;
                force += at.Q - both;
                twist[i] = q.twist;
            }
            const Mask<Real> turns = b.turns[j] > none;
            const L factor = j > 0 ? coupling * inverse_[j - 1] : none;
            L pivot = select<Real>(turns, diagonal, one), value = select<Real>(turns, force, none);
            if (j > 0) pivot -= factor * coupling, value -= factor * right_[j - 1];
            inverse_[j] = reciprocal<Real>(pivot), right_[j] = value, upper_[j] = next_coupling;
            diagonal = next_diagonal, force = next_force, coupling = next_coupling;
        }
        L after = none, turn_after = none;
        for (int j = b.P - 2; j >= 0; --j) {
            after = (right_[j] - upper_[j] * after) * inverse_[j];
            const L half = half_turn<Real>(after), turn = 2 * arc_tangent<Real>(half);
            m[j] = turned(m[j], t[j], half);
            if (j + 1 < b.P - 1) twist[j + 1] += turn_after - turn;
            if (by) by[j] = turn;
            turn_after = turn;
        }
    }

  private:
    Vec3<Real> *t_;
    Joint<Real> *joints_;
    L *inverse_, *upper_, *right_; // of the eliminated tridiagonal matrix
};

} // namespace ringlet
