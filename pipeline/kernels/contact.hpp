// Contact of strands with the head: rows in the solve, then pushes and Coulomb friction between length steps.
//
// Steps a to d2 and e of docs/physics.md, "Contact with the head". Notation: phi signed distance at the head's new pose,
// h contact offset of the point, n world normal, g = phi - h gap, N contact force over the mean mass [m/s^2],
// s displacement that the contact force is worth [m], a 1 where the contact holds.
// The distance tells how deep a point is and which way is out, but not on which side of a thin part it was. A point that
// moves far relative to the head in a step is followed along its way (path.hpp); where that leads through the head, phi
// is the distance to the plane on which it went in.
#pragma once

#include "block.hpp"
#include "distance_field.hpp"
#include "path.hpp"
#include "settings.hpp"

#include <optional>

namespace ringlet {

inline constexpr double kRow = 1e3;         // stiffness of a row, in m / dt^2
inline constexpr double kKeepGap = 0.2e-3;  // [m] a contact that pushed keeps its row up to this gap
inline constexpr double kKeepWeight = 0.2;  // and closes this part of the gap
inline constexpr double kPull = 0.01;       // [m/s^2] a row that pulls more than this is dropped
inline constexpr int kReleases = 2;         // times that rows are dropped in a step
inline constexpr int kDroppedMost = 8;      // rows of a lane that are taken out of a solution (dropped_rows.hpp)
inline constexpr double kDepth = 0.05e-3;   // [m] depth below the offset that is let pass
inline constexpr double kWay = 0.7;         // [cells] a shorter way in a step cannot lead through what cells resolve

/// The head during one step or a part of one.
template <class Real> struct HeadStep {
    using L = Lanes<Real>;
    const DistanceField *field; // null for no head
    Pose before, after;
    Rigid<Real> was, local;     // world -> rest frame, at the old pose and at the new one
    Rigid<Real> turn;           // rest frame -> world at the new pose
    Rigid<Real> carry;          // world -> world: what moves with the head from the old pose to the new one
    const Deformation *deformation; // null for a rigid skin
    Real blend, drift;              // at the end; how much of the drift this step takes
    double steepest;                // bound of the slope

    HeadStep(const DistanceField *field, const Interval<Real> &interval)
        : field(field), before(interval.poses.head[0]), after(interval.poses.head[1]), was(before.inverse()),
          local(after.inverse()), turn(after), carry(after * before.inverse()), deformation(interval.skin.deformation),
          blend(Real(interval.skin.blend_at(1))),
          drift(Real(interval.skin.blend_at(1) - interval.skin.blend_at(0))), steepest(field ? field->steepest : 1) {
        if (deformation) steepest = std::max(steepest, deformation->after.steepest);
    }

    /// Distance and its gradient (not normalised) at points of the rest frame, at the end of the step.
    RINGLET_INLINE void measure(Vec3<Real> at, L &phi, Vec3<Real> &gradient) const {
        sample<Real>(*field, at, phi, gradient);
        if (deformation) measure_deformed(at, phi, gradient);
    }

    /// The same with the corners of the cells that were read last: points seldom leave their cells.
    __attribute__((noinline)) void measure(Vec3<Real> at, Mask<Real> &last, Corners<Real> &corners, L &phi,
                                           Vec3<Real> &gradient) const {
        const Cells<Real> cells(*field, at);
        const Mask<Real> changed = cells.at != last;
        if (any<Real>(changed)) {
            corners.read(*field, cells.at, changed);
            last = cells.at;
        }
        corners.interpolate(cells, phi, gradient);
        if (deformation) measure_deformed(at, phi, gradient);
    }

    /// Where points that touch the skin would be if they had moved with it during the step.
    RINGLET_INLINE Vec3<Real> carried(Vec3<Real> old) const { return deformation ? carried_deformed(old) : carry(old); }

    /// Where a point that moves straight through the world is at half time, seen from the head: from its places in the
    /// rest frame at the beginning and at the end.
    Vec3<Real> between(Vec3<Real> begin, Vec3<Real> end) const {
        const L half = splat(Real(0.5));
        if (!middle_) middle_.emplace(halfway(before, after).inverse());
        return (*middle_)(half * (Rigid<Real>(before)(begin) + turn(end)));
    }

  private:
    __attribute__((noinline)) void measure_deformed(Vec3<Real> at, L &phi, Vec3<Real> &gradient) const {
        L next;
        Vec3<Real> slope;
        sample<Real>(deformation->after, at, next, slope);
        const L w = splat(blend);
        phi += w * (next - phi);
        gradient = gradient + w * (slope - gradient);
    }

    __attribute__((noinline)) Vec3<Real> carried_deformed(Vec3<Real> old) const {
        const Vec3<Real> at = was(old);
        L moved[3];
        Vec3<Real> slope;
        for (int k = 0; k < 3; ++k) sample<Real>(deformation->drift[k], at, moved[k], slope);
        return turn(at + splat(drift) * Vec3<Real>{moved[0], moved[1], moved[2]});
    }

    mutable std::optional<Rigid<Real>> middle_; // world -> rest frame at half time, once it is asked for
};

template <class Real> struct Contacts {
    using L = Lanes<Real>;
    const L none = splat(Real(0)), one = splat(Real(1));
    Vec3<Real> *n, *nearby;    // normal of the contact; place of the last sample in the head's frame
    Vec3<Real> *start;         // where the step begins, in the head's frame
    L *phi;                    // distance there
    Mask<Real> *cell;          // its cell in the field, -1 for none, and what was read there
    Corners<Real> *corners;
    L *row, *gap, *N;          // rows: 1 where one acts, g', contact force of the solve
    L *dropped;                // in which release of this step a row has been dropped (1, 2, ...), else 0
    L *a, *s, *fresh, *stuck;  // rounds: contact holds, worth, new part of s, held by friction
    bool any_row = false;

    Contacts(Arena &arena, int P)
        : n(arena.take<Vec3<Real>>(P)), nearby(arena.take<Vec3<Real>>(P)), start(arena.take<Vec3<Real>>(P)),
          cell(arena.take<Mask<Real>>(P)), corners(arena.take<Corners<Real>>(P)) {
        for (auto **array : {&phi, &row, &gap, &N, &dropped, &a, &s, &fresh, &stuck}) *array = arena.take<L>(P);
    }

    /// Forgets the samples: nothing is known to be far.
    void forget(int P) {
        for (int i = 0; i < P; ++i) phi[i] = splat(Real(-1e3)), nearby[i] = Vec3<Real>{};
        leave_cells(P);
    }

    /// Other strands come, whose points lie in other cells.
    void leave_cells(int P) {
        for (int i = 0; i < P; ++i) cell[i] = Mask<Real>{} - 1;
    }

    /// The skin may have come nearer by so much [m] since the samples.
    void age(int P, Real nearer) {
        for (int i = 0; i < P; ++i) phi[i] -= nearer;
    }

    /// Samples the field at point i; false when none of the lanes `of` can be within `reach` of the surface, or has
    /// passed it in this step. A sample is spared when the last one and the steepest slope of the field prove as much.
    RINGLET_INLINE bool near(const HeadStep<Real> &head, int i, Vec3<Real> x, L reach, Mask<Real> of, L &distance,
                             Vec3<Real> &normal) {
        const Vec3<Real> at = head.local(x), moved = at - nearby[i], begun = start[i] - nearby[i];
        L square = maximum<Real>(dot(moved, moved), dot(begun, begun)); // a ball that holds both ends holds the way
        const L room = phi[i] - reach;
        const Real slope = Real(head.steepest);
        if (!any<Real>(of & ~((room > none) & (room * room > slope * slope * square)))) return false;
        head.measure(at, cell[i], corners[i], distance, normal);
        nearby[i] = at, phi[i] = distance;
        const Vec3<Real> way = at - start[i];
        const Real far = Real(kWay * head.field->spacing);
        const Mask<Real> goes_far = dot(way, way) > far * far;
        if (any<Real>(of & goes_far))
            follow<Real>(head, Way<Real>(start[i], head.between(start[i], at), at), goes_far, distance, normal);
        if (!any<Real>(of & (distance < reach))) return false;
        normal = head.turn.turn(inverse_root<Real>(dot(normal, normal) + Real(1e-20)) * normal);
        return true;
    }

    /// Step a: which points get a row, from their predicted positions. One that did not press in the last step may go as
    /// deep as is let pass: hair that lies still has points that lengths push by a thousandth of that, step after step,
    /// whose rows would only pull and make a second solve.
    void find_rows(const Block<Real> &b, const HeadStep<Real> &head, const Motion<Real> &from, Real dt) {
        any_row = false;
        if (head.deformation) age(b.P, Real(std::abs(head.drift) * head.deformation->fastest));
        const L passed = splat(Real(-kDepth)), keep = splat(Real(kKeepGap));
        for (int i = 0; i < b.P; ++i) {
            row[i] = none, dropped[i] = none, a[i] = none, s[i] = none, fresh[i] = none, stuck[i] = none, N[i] = none;
            if (!head.field || i < b.first) continue;
            start[i] = head.was(from.x[i]);
            L distance;
            Vec3<Real> normal;
            const L reach = b.offset[i] + Real(kKeepGap);
            const Vec3<Real> predicted = from.x[i] + splat(dt) * from.v[i];
            if (!near(head, i, predicted, reach, b.free[i] > none, distance, normal)) continue;
            L g = distance - b.offset[i];
            const Mask<Real> on = (b.free[i] > none) & (g < select<Real>(from.touch[i] == one, keep, passed));
            row[i] = select<Real>(on, one, none);
            gap[i] = select<Real>(g > none, Real(kKeepWeight) * g, g);
            n[i] = select(on, normal, n[i]);
            any_row = any_row || any<Real>(on);
        }
        if (any_row) keep_deepest(b, from);
    }

    /// Of points that come upon the head next to one another only the deepest keep their rows: a stiff strand takes the
    /// others along, and their rows would pull.
    void keep_deepest(const Block<Real> &b, const Motion<Real> &from) {
        const auto below = [&](int i) { return i < b.P ? select<Real>(row[i] > none, gap[i], none) : none; };
        L before = none, here = below(b.first);
        for (int i = b.first; i < b.P; ++i) {
            const L after = below(i + 1);
            const Mask<Real> deepest = (here <= before) & (here <= after);
            row[i] = select<Real>(deepest | (from.touch[i] == one), row[i], none);
            before = here, here = after;
        }
    }

    /// Step b: contact forces of the solution u in some lanes; drops rows that pull. `number` 1, 2, ...
    /// Returns the lanes with such rows.
    Mask<Real> release(const Block<Real> &b, const Motion<Real> &from, const Vec3<Real> *u, Real dt, int number,
                       Mask<Real> lanes) {
        Mask<Real> found{};
        const Real k = Real(kRow) / (dt * dt);
        for (int i = b.first; i < b.P; ++i) {
            N[i] = select<Real>(lanes, row[i] * (-k) * (gap[i] + dt * dot(n[i], u[i] - from.v[i])), N[i]);
            const Mask<Real> pulls = lanes & (N[i] < Real(-kPull));
            found |= pulls;
            row[i] = select<Real>(pulls, none, row[i]);
            dropped[i] = select<Real>(pulls, splat(Real(number)), dropped[i]);
        }
        return found;
    }

    /// Lanes in which so many rows have been dropped that it is cheaper to solve without them than to take them out.
    Mask<Real> too_many_dropped(const Block<Real> &b) const {
        L count = none;
        for (int i = b.first; i < b.P; ++i) count += select<Real>(dropped[i] > none, one, none);
        return count > Real(kDroppedMost);
    }

    /// Step c: what the forces of the rows are worth as displacements.
    void begin_rounds(const Block<Real> &b, Motion<Real> &to, L theta_dt2) {
        for (int i = b.first; i < b.P; ++i) {
            N[i] = row[i] * maximum<Real>(N[i], none);
            a[i] = select<Real>(N[i] > none, one, none);
            s[i] = theta_dt2 * b.w[i] * N[i];
            fresh[i] = s[i];
            to.touch[i] = a[i];
        }
    }

    /// Steps d1 and d2 for the lanes that are busy: pushes points out, then friction against the head's motion with
    /// the new part of s as budget. Returns the depth of each lane before the push. `solved`: no lengths have moved
    /// points since the solve, which is then what presses.
    L push(const Block<Real> &b, const HeadStep<Real> &head, const Vec3<Real> *old, Real friction, Mask<Real> busy,
           bool solved, Motion<Real> &to) {
        L deepest = none;
        if (!head.field) return deepest;
        for (int i = b.first; i < b.P; ++i) {
            L distance;
            Vec3<Real> normal;
            const L reach = b.offset[i] + Real(kKeepGap);
            const Mask<Real> moves = busy & (b.free[i] > none);
            if (!near(head, i, to.x[i], reach, moves, distance, normal)) continue;
            Mask<Real> here = moves & (distance < reach);
            n[i] = select(here, normal, n[i]);
            L depth = select<Real>(here, maximum<Real>(b.offset[i] - distance, none), none);
            deepest = maximum<Real>(deepest, depth);
            if (!any<Real>((depth + fresh[i]) > none)) continue;
            to.x[i] = to.x[i] + depth * n[i];
            a[i] = select<Real>(depth > none, one, a[i]);
            const L touch = solved ? one : select<Real>(to.touch[i] == one, one, one + one);
            to.touch[i] = select<Real>(depth > none, touch, to.touch[i]);
            s[i] += depth;
            rub(head, i, old[i], friction, depth, here, to);
        }
        return deepest;
    }

    /// Depth of the deepest free point of each lane below its offset.
    L depth(const Block<Real> &b, const HeadStep<Real> &head, const Vec3<Real> *x) {
        L deepest = none;
        for (int i = b.first; head.field && i < b.P; ++i) {
            L distance;
            Vec3<Real> normal;
            if (!near(head, i, x[i], b.offset[i], b.free[i] > none, distance, normal)) continue;
            deepest = maximum<Real>(deepest, select<Real>(b.free[i] > none, b.offset[i] - distance, none));
        }
        return deepest;
    }

    /// Step d2 at point i: takes the sliding back as far as the budget mu (new part of s) goes.
    RINGLET_INLINE void rub(const HeadStep<Real> &head, int i, Vec3<Real> old, Real friction, L depth, Mask<Real> here,
                            Motion<Real> &to) {
        L budget = select<Real>(here, friction * (depth + fresh[i]), none);
        fresh[i] = select<Real>(here, none, fresh[i]);
        Vec3<Real> moved = to.x[i] - head.carried(old), slid = moved - dot(moved, n[i]) * n[i];
        const L square = dot(slid, slid) + Real(1e-30), per_length = inverse_root<Real>(square);
        Mask<Real> holds = (budget * budget >= square) & (budget > none);
        L part = select<Real>(holds, one, budget * per_length);
        to.x[i] = to.x[i] - part * slid;
        stuck[i] = select<Real>(holds, one, stuck[i]);
    }

    /// Step e: velocity of a point that touches: across the surface the head's, along it the head's where stuck.
    RINGLET_INLINE Vec3<Real> velocity(const HeadStep<Real> &head, int i, Vec3<Real> old, Vec3<Real> now,
                                       Vec3<Real> v_free, Real dt) const {
        Mask<Real> on = (a[i] > none) | (row[i] > none);
        if (!any<Real>(on)) return v_free;
        const L per_second = splat(1 / dt);
        Vec3<Real> carried = head.carried(old), v_head = per_second * (carried - old);
        Vec3<Real> moved = now - carried, slid = moved - dot(moved, n[i]) * n[i];
        Vec3<Real> relative = v_free - v_head, sliding = relative - dot(relative, n[i]) * n[i];
        Vec3<Real> along = select(stuck[i] > none, per_second * slid, sliding);
        return select(on, v_head + along, v_free);
    }
};

} // namespace ringlet
