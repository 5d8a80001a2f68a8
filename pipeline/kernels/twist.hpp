// Directors of "kirchhoff" strands: how they start, follow the points through a step, and find their twist.
//
// Notation as in kirchhoff.hpp: t_j tangent of segment j, m_j its director, theta_j a turn of it about t_j.
// A step begins with one Newton step towards the quasi-static twist, dE/dtheta = 0 for every free director: a tridiagonal
// system per strand. Its matrix is the exact one, but for the part g of bending in it, which counts where it is positive:
//     diagonal += (C + g) / dl at both segments of a joint, beside it (g - C) / dl
// The joints that it works on, turned with their directors, are those that the solve is made of. At its end the step takes
// directors along by parallel transport in time (the smallest turn from the old tangent to the new one) and turns them as
// the solve predicts.
// Source: Bergou et al., "Discrete elastic rods" (2008), sections 4.2 and 5 (quasi-static material frame);
// "Discrete viscous threads" (2010), section 3 (parallel transport in time). We differ in taking one step, not
// iterating: what is left over acts in the next time step (statics: test_an_equilibrium_is_one_for_every_dt).
#pragma once

#include "kirchhoff.hpp"
#include "settings.hpp"

namespace ringlet {

inline constexpr double kMostTurn = 1.06; // [rad] that a step turns a director by, at most: a root at 10 turns/s and 1/60 s
inline constexpr double kMostCorrection = 0.8; // [rad] that the Newton step turns it by, at most
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

/// A turn of directors by the angle 2 arctan(u): c and s are cosine and sine of half of it.
template <class Real> struct Turn {
    Lanes<Real> u, c, s;

    explicit RINGLET_INLINE Turn(Lanes<Real> u) : u(u), c(inverse_root<Real>(1 + u * u)), s(u * c) {}

    /// m turned about t.
    RINGLET_INLINE Vec3<Real> operator()(Vec3<Real> m, Vec3<Real> t) const {
        return (c * c - s * s) * m + (2 * s * c) * cross(t, m);
    }
};

/// Half of an angle that is cut off at the most.
template <class Real> RINGLET_INLINE Lanes<Real> half_turn(Lanes<Real> angle, double most) {
    const Lanes<Real> half = splat(Real(0.5 * most));
    return minimum<Real>(maximum<Real>(Real(0.5) * angle, -half), half);
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
    L *spin;             // velocity of s = l theta: known for held directors, else from the solve
    Vec3<Real> *m;       // directors where the step is linearised
    Joint<Real> *joints; // of these directors

    Directors(Arena &arena, int P)
        : spin(arena.take<L>(P)), m(arena.take<Vec3<Real>>(P)), joints(arena.take<Joint<Real>>(P)) {
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

    /// Free directors at the end of the step, from those where it is linearised.
    void follow(const Block<Real> &b, const Edges<Real> &edges, Real dt, Motion<Real> &to) {
        for (int j = 0; j < b.P - 1; ++j) {
            const Vec3<Real> edge = to.x[j + 1] - to.x[j], t = inverse_root<Real>(dot(edge, edge)) * edge;
            const Vec3<Real> moved = squared(transport(m[j], edges.d[j], t), t);
            const L ahead = edges.ahead ? edges.ahead_s[j] : L{};
            const L half = half_turn<Real>(edges.il[j] * (dt * spin[j] - ahead), kMostTurn);
            const Turn<Real> turn(half + (Real(1.0 / 3) * half) * (half * half)); // its tangent, to 2 % at most
            to.m[j] = select(b.turns[j] > 0, turn(moved, t), to.m[j]);
            if (j > 0) to.twist[j] = joints[j].twist;
        }
    }

    /// The directors of lanes whose strand only moved on: they keep their directors.
    void carry(const Block<Real> &b, const Motion<Real> &from, Motion<Real> &to, Mask<Real> lanes) {
        for (int j = 0; j < b.P - 1; ++j) {
            to.m[j] = select(lanes & (b.turns[j] > 0), from.m[j], to.m[j]);
            to.twist[j] = select<Real>(lanes, from.twist[j], to.twist[j]);
        }
    }

    /// One Newton step of dE/dtheta = 0 for directors `given` at the tangents t: makes `m` and `joints` of them. The
    /// twists are those nearest to `before`; `by`, unless null, tells how far directors have turned.
    void relax(const Block<Real> &b, const Vec3<Real> *t, const Vec3<Real> *given, const L *before, L *by) {
        // Joints for themselves: each is a long chain of operations, and many of them go side by side
        for (int i = 1; i < b.P - 1; ++i) joints[i] = Joint<Real>(t[i - 1], t[i], given[i - 1], given[i], before[i]);
        eliminate(b);
        L after = splat(Real(0)), angle_after = after;
        Turn<Real> turn_after(after);
        for (int j = b.P - 2; j >= 0; --j) {
            after = (right_[j] - upper_[j] * after) * inverse_[j];
            const Turn<Real> turn(half_turn<Real>(after, kMostCorrection));
            const L angle = 2 * arc_tangent<Real>(turn.u);
            m[j] = turn(given[j], t[j]);
            if (j + 1 < b.P - 1) {
                const L both = turn.c * turn_after.c;
                joints[j + 1].turn(both - turn.s * turn_after.s, turn.s * turn_after.c + turn.c * turn_after.s,
                                   angle_after - angle);
            }
            if (by) by[j] = angle;
            turn_after = turn, angle_after = angle;
        }
    }

  private:
    L *inverse_, *upper_, *right_; // of the eliminated tridiagonal matrix

    /// Eliminates the Newton step's matrix from the root.
    void eliminate(const Block<Real> &b) {
        const L none = splat(Real(0)), one = splat(Real(1));
        L diagonal = none, force = none, coupling = none; // of segment j: from the joint before it
        for (int j = 0; j < b.P - 1; ++j) {
            L next_diagonal = none, next_force = none, next_coupling = none;
            if (j + 1 < b.P - 1) {
                const int i = j + 1;
                const Joint<Real> &q = joints[i];
                const Moments<Real> at(b, i, q);
                const L both = Real(0.5) * (at.M1 * q.k2 - at.M2 * q.k1), per_length = b.inverse_dl[i];
                const L g = Real(0.25) * maximum<Real>(turning_stiffness(b, i, q), none);
                next_diagonal = per_length * (b.k_tau + g + kLeastTwisting<Real> * (b.k_kappa + b.k_tau)) + Real(kNoStiffness);
                next_coupling = per_length * (g - b.k_tau) * b.turns[j] * b.turns[i];
                next_force = -both - at.Q;
                diagonal += next_diagonal;
                force += at.Q - both;
            }
            const Mask<Real> turns = b.turns[j] > none;
            const L factor = j > 0 ? coupling * inverse_[j - 1] : none;
            L pivot = select<Real>(turns, diagonal, one), value = select<Real>(turns, force, none);
            if (j > 0) pivot -= factor * coupling, value -= factor * right_[j - 1];
            inverse_[j] = reciprocal<Real>(pivot), right_[j] = value, upper_[j] = next_coupling;
            diagonal = next_diagonal, force = next_force, coupling = next_coupling;
        }
    }
};

} // namespace ringlet
