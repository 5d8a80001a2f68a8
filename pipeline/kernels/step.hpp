// One time step of a block of strands: solve, contact and length relaxation in rounds, velocities; halved on failure.
//
// The scheme: docs/physics.md, "One step" and "Contact". A lane that has converged is left alone while others go on, and
// a halved step is taken over only by the lanes that needed it: the motion of a strand does not depend on the strands
// beside it (test_a_strand_moves_the_same_alone_and_among_others).
#pragma once

#include "bow.hpp"
#include "implicit.hpp"
#include "implicitness.hpp"
#include "relaxation.hpp"
#include "ahead.hpp"

#include <memory>
#include <vector>

namespace ringlet {

inline constexpr int kHalvings = 6;

/// What happened, added up over the steps of a block. Per lane where lanes differ.
template <class Real> struct Tally {
    Lanes<Real> strain{}, depth{};
    long rounds = 0, solves = 0, halvings = 0;
    int rounds_max = 0, bad_strand = -1;
    double contacts = 0;
};

/// Steps one block. All memory comes from the arena, once.
template <class Real> class Stepper {
    using L = Lanes<Real>;
    using M = Mask<Real>;

  public:
    Block<Real> block;
    Motion<Real> now;
    Contacts<Real> contacts;
    Tally<Real> tally;
    const Outside<Real> *outside = nullptr; // forces of other strands, if they are counted

    Stepper(Arena &arena, int P, const StepSettings &settings, const DistanceField *field)
        : block(arena, P), now(arena, P), contacts(arena, P), settings_(settings), field_(field), next_(arena, P),
          edges_(arena, P), lengths_(arena, P), directors_(arena, P), ahead_(arena, P), solvers_(arena, P, settings.torsion),
          f_(arena.take<Vec3<Real>>(P)), u_(arena.take<Vec3<Real>>(P)), star_(arena.take<Vec3<Real>>(P)) {
    }

    /// Bytes that a Stepper takes from its arena.
    static size_t bytes(int P) {
        constexpr size_t pivots = 2 * (4 * 15 + 8), motions = 2, points = 128;
        return sizeof(L) * ((pivots + points) * P + 4096) + motions * Motion<Real>::bytes(P);
    }

    /// Takes a block of strands in, or gives it back after the step.
    void exchange(Resident<Real> &other) {
        std::swap(block, other.block);
        std::swap(now, other.now);
        std::swap(contacts.nearby, other.nearby);
        std::swap(contacts.phi, other.phi);
        contacts.leave_cells(block.P);
    }

    void step(const Interval<Real> &interval, M wanted) {
        hopeless_ = M{};
        advance(interval, now, next_, wanted, 0);
        std::swap(now, next_);
        if (!field_) return;
        for (int i = block.first; i < block.P; ++i) {
            const Mask<Real> touching = wanted & (now.touch[i] > 0);
            if (!any<Real>(touching)) continue;
            for (int lane = 0; lane < kLanes<Real>; ++lane) tally.contacts += touching[lane] ? 1 : 0;
        }
    }

  private:
    bool has_directors() const { return settings_.torsion == Torsion::kirchhoff; }

    const StepSettings &settings_;
    const DistanceField *field_;
    Motion<Real> next_;
    std::unique_ptr<Arena> spare_;      // memory of halved steps, once there is one
    std::vector<Motion<Real>> halves_;
    Edges<Real> edges_;
    Lengths<Real> lengths_;
    Directors<Real> directors_;
    Ahead<Real> ahead_;
    Solvers<Real> solvers_;
    const Vec3<Real> *start_ = nullptr; // directors where the edges are
    Vec3<Real> *f_, *u_, *star_; // forces, velocities of travel, points before the rounds
    M hopeless_{};               // lanes that failed in the shortest step too: not halved again in this one

    /// One step, or two half steps for the lanes in which it fails (step f).
    void advance(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to, M wanted, int depth) {
        const Tally<Real> before = tally;
        M failed = attempt(interval, from, to, wanted);
        const M again = failed & hopeless_; // no use to halve again in this step
        stand_still(interval, from, to, again);
        failed &= ~again;
        if (!any<Real>(failed)) return;
        keep_accepted(before, failed);
        if (depth == kHalvings) {
            hopeless_ |= failed;
            stand_still(interval, from, to, failed);
            return;
        }
        if (!spare_) make_halves();
        Motion<Real> &middle = halves_[2 * depth], &end = halves_[2 * depth + 1];
        advance(interval.halved(false), from, middle, failed, depth + 1);
        advance(interval.halved(true), middle, end, failed, depth + 1);
        for (int i = 0; i < block.P; ++i) {
            to.x[i] = select(failed, end.x[i], to.x[i]);
            to.v[i] = select(failed, end.v[i], to.v[i]);
            to.T[i] = select<Real>(failed, end.T[i], to.T[i]);
            to.touch[i] = select<Real>(failed, end.touch[i], to.touch[i]);
            to.m[i] = select(failed, end.m[i], to.m[i]);
            to.twist[i] = select<Real>(failed, end.twist[i], to.twist[i]);
        }
    }

    void make_halves() {
        spare_ = std::make_unique<Arena>(2 * kHalvings * Motion<Real>::bytes(block.P));
        for (int k = 0; k < 2 * kHalvings; ++k) halves_.emplace_back(*spare_, block.P);
    }

    /// What no step can take, because contacts leave no room for the strand, keeps its shape and follows its root:
    /// lengths hold, the depth is what it is and `Report::depth` tells it.
    void stand_still(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to, M lanes) {
        if (!any<Real>(lanes)) return;
        const L per_second = splat(Real(1) / Real(interval.dt));
        for (int i = std::max(block.first, 1); i < block.P; ++i) {
            M moved = lanes & (block.free[i] > 0);
            to.x[i] = select(moved, to.x[i - 1] + (from.x[i] - from.x[i - 1]), to.x[i]);
        }
        if (block.held_inside) close_runs(block, from.x, lanes, to.x);
        for (int i = std::max(block.first, 1); i < block.P; ++i)
            to.v[i] = select(lanes & (block.free[i] > 0), per_second * (to.x[i] - from.x[i]), to.v[i]);
        for (int j = 0; j < block.P - 1; ++j) to.T[j] = select<Real>(lanes, from.T[j], to.T[j]);
        if (has_directors()) directors_.carry(block, from, to, lanes);
        const HeadStep<Real> head(field_, interval);
        tally.strain = maximum<Real>(tally.strain, select<Real>(lanes, lengths_.strain(block, to.x), L{}));
        tally.depth = maximum<Real>(tally.depth, select<Real>(lanes, contacts.depth(block, head, to.x), L{}));
    }

    /// A failed attempt is not a step's end: its strain and depth do not count.
    void keep_accepted(const Tally<Real> &before, M failed) {
        ++tally.halvings;
        tally.strain = select<Real>(failed, before.strain, tally.strain);
        tally.depth = select<Real>(failed, before.depth, tally.depth);
    }

    /// The whole step from one motion to another; the lanes in which lengths and contacts did not converge.
    M attempt(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to, M wanted) {
        const Real dt = Real(interval.dt);
        const HeadStep<Real> head(field_, interval);
        move_held(interval, from, to);
        start_ = linearise(from, dt);
        hold_directors(interval, from, to);
        contacts.find_rows(block, head, from, dt);
        if (settings_.is_explicit) explicit_velocities(interval, from, to);
        else implicit_velocities(interval, from, to, wanted);
        for (int i = block.first; i < block.P; ++i) {
            star_[i] = select(block.free[i] > 0, from.x[i] + splat(dt) * u_[i], to.x[i]);
            to.x[i] = star_[i];
        }
        if (block.held_inside) {
            const M stretched = lengths_.strain(block, to.x) > Real(settings_.tolerance);
            bow_out(block, interval.gravity, wanted & stretched, to.x);
        }
        M failed = relax(head, from, to, block.theta * (dt * dt), wanted);
        finish(head, from, to, dt);
        if (has_directors()) directors_.follow(block, edges_, dt, to);
        return failed;
    }

    /// Sets the edges that forces and stiffness are taken at; their directors.
    const Vec3<Real> *linearise(const Motion<Real> &from, Real dt) {
        edges_.follow(from.x, block.P);
        if (settings_.is_explicit || settings_.look_ahead == 0) {
            if (!has_directors()) return from.m;
            directors_.relax(block, edges_.d, from.m, from.twist, nullptr);
            return directors_.m;
        }
        return ahead_.look(block, from, u_, block.theta * dt, Real(settings_.look_ahead), has_directors(), directors_, edges_);
    }

    /// Held points go with the head or the hand.
    void move_held(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to) {
        const Rigid<Real> head(interval.poses.head[1]), hand(interval.poses.hand[1]);
        const L per_second = splat(Real(1) / Real(interval.dt));
        for (int i = 0; i < block.P; ++i) {
            if (i >= block.first && !block.held_inside) break;
            to.x[i] = select(block.hand[i] > 0, hand(block.anchor[i]), head(interval.skin.place(block.anchor[i])));
            u_[i] = per_second * (to.x[i] - from.x[i]);
        }
    }

    /// Held directors go with the head or the hand; of the others only "kirchhoff" takes care.
    void hold_directors(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to) {
        directors_.hold(block, edges_, start_, interval, from, to);
        if (!has_directors()) std::copy_n(from.twist, block.P, to.twist);
    }

    /// Banded solve; rows that would pull are dropped and taken out of the solution, at most twice.
    void implicit_velocities(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to, M wanted) {
        const Equation<Real> equation{block,    from,   interval, settings_,        contacts,
                                      edges_, start_, directors_.joints, outside};
        solvers_.with(settings_.torsion, [&](auto &solver) {
            const Velocities<Real> unknown{u_, directors_.spin};
            const auto release = [&](int number, M lanes) {
                return contacts.release(block, from, u_, Real(interval.dt), number, lanes);
            };
            solver.solve(equation, ~M{}, unknown);
            ++tally.solves;
            if (!contacts.any_row) return;
            M many{}, pulled = release(1, wanted);
            for (int number = 1; number <= kReleases; ++number) {
                many |= pulled & contacts.too_many_dropped(block);
                pulled &= ~many;
                if (!any<Real>(pulled)) break;
                solver.drop(equation, number, pulled, unknown);
                pulled = release(number + 1, pulled);
            }
            for (int again = 0; any<Real>(many) && again < kReleases; ++again) {
                solver.solve(equation, many, unknown);
                ++tally.solves;
                many = release(again + 2, many);
            }
        });
        predict_tensions(equation, u_, to.T);
    }

    /// Symplectic Euler: no matrix, no tension, no rows; lengths and contacts are left to the rounds.
    void explicit_velocities(const Interval<Real> &interval, const Motion<Real> &from, Motion<Real> &to) {
        const L dt = splat(Real(interval.dt));
        steady_forces(block, settings_, from, start_, edges_, f_);
        for (int i = block.first; i < block.P; ++i) {
            Drag<Real> drag(block, from, i, settings_, interval.wind);
            Vec3<Real> v = from.v[i];
            Vec3<Real> slowing = drag.c_perp * v + ((drag.c_par - drag.c_perp) * dot(v, drag.t)) * drag.t;
            Vec3<Real> a = (1 / block.mu[i]) * f_[i] + interval.gravity + drag.push - slowing;
            if (outside) a = a + acceleration(*outside, i, v);
            u_[i] = select(block.free[i] > 0, v + dt * a, u_[i]);
            contacts.row[i] = L{};
        }
        for (int j = 0; j < block.P; ++j) to.T[j] = from.T[j];
    }

    /// Step d: push, friction, lengths, until strain and depth are both small on the same points.
    M relax(const HeadStep<Real> &head, const Motion<Real> &from, Motion<Real> &to, L theta_dt2, M wanted) {
        const bool newton = settings_.relaxation == Relaxation::newton;
        const int most = newton ? kNewtonRounds : kSweepRounds;
        contacts.begin_rounds(block, to, theta_dt2);
        lengths_.clear(block.P);
        M busy = wanted;
        L strain{}, depth{};
        for (int round = 0;; ++round) {
            const L pushed = contacts.push(block, head, from.x, Real(settings_.friction), busy, round == 0, to);
            depth = select<Real>(busy, pushed, depth);
            strain = select<Real>(busy, lengths_.strain(block, to.x), strain);
            M stretched = strain > Real(settings_.tolerance);
            busy = busy & (stretched | (depth > Real(kDepth)));
            if (!any<Real>(busy) || round == most) {
                tally.rounds += round;
                tally.rounds_max = std::max(tally.rounds_max, round);
                break;
            }
            if (newton) lengths_.newton(block, contacts, busy & stretched, to.x);
            else lengths_.sweep(block, contacts, busy & stretched, to.x);
        }
        tally.strain = maximum<Real>(tally.strain, select<Real>(wanted, strain, L{}));
        tally.depth = maximum<Real>(tally.depth, select<Real>(wanted, depth, L{}));
        return busy;
    }

    /// Velocities from the positions (step e) and tensions from the multipliers (step g).
    void finish(const HeadStep<Real> &head, const Motion<Real> &from, Motion<Real> &to, Real dt) {
        const L per_theta = 1 / block.theta, per_move = per_theta * splat(1 / dt);
        const L per_square = block.m0 * per_move * splat(1 / dt);
        if (!settings_.is_explicit)
            for (int j = 0; j < block.P - 1; ++j) to.T[j] -= per_square * lengths_.lambda[j] * block.inverse_l[j];
        for (int i = 0; i < block.P; ++i) {
            if (i < block.first) {
                to.v[i] = u_[i];
                continue;
            }
            Vec3<Real> v = from.v[i] + per_theta * (u_[i] - from.v[i]) + per_move * (to.x[i] - star_[i]);
            if (field_) v = contacts.velocity(head, i, from.x[i], to.x[i], v, dt);
            to.v[i] = select(block.free[i] > 0, v, u_[i]);
        }
    }
};

} // namespace ringlet
