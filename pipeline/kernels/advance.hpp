// All strands over the steps of a drive: blocks in parallel, each through all steps before the next.
//
// A block reads its strands, steps, and writes them back; blocks share nothing but what they read, so that no result
// depends on the number of threads.
#pragma once

#include "step.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace ringlet {

/// A segment whose length is less or more than this part of what it should be is torn: no relaxation brings it back.
inline constexpr double kShort = 0.5, kLong = 1.5;

/// The caller's arrays of a state.
template <class Real> struct StateArrays {
    Real *points, *velocity, *tension;
    uint8_t *contact;
    Real *directors, *twist;
};

/// What moves the strands: `steps + 1` poses of head and hand, `steps` winds; how the skin moves against the head.
struct Drive {
    int steps = 0;
    std::vector<Pose> head, hand;
    std::vector<double> wind;  // (steps, 3) [m/s]
    std::vector<double> roots; // (steps + 1, S, 3, 4), or empty: the rigid map of each root in the head's frame
    std::vector<double> blend; // (steps + 1,), or empty
    std::shared_ptr<const Deformation> deformation;
};

/// The roots of a block's strands before or after a step.
template <class Real> RootPose<Real> root_pose(const Drive &drive, int k, int S, const BlockIndex<Real> &index) {
    RootPose<Real> pose;
    Vec3<Real> columns[4] = {};
    gather(columns, drive.roots.data() + size_t(k) * S * 12, 4, index.strand); // 12 numbers a strand, row by row
    const Vec3<Real> *c = columns;
    pose.row[0] = {c[0].x, c[0].y, c[0].z}, pose.row[1] = {c[1].y, c[1].z, c[2].x}, pose.row[2] = {c[2].z, c[3].x, c[3].y};
    pose.t = {c[1].x, c[2].y, c[3].z};
    return pose;
}

/// Step k of a drive for one block; `roots` is memory for the roots of its strands.
template <class Real>
Interval<Real> interval_of(const Drive &drive, int k, const StepSettings &settings, int S,
                           const BlockIndex<Real> &index, RootPose<Real> (&roots)[2]) {
    const Poses poses{{drive.head[k], drive.head[k + 1]}, {drive.hand[k], drive.hand[k + 1]}};
    Interval<Real> interval{settings.dt, poses, broadcast<Real>(settings.gravity), broadcast<Real>(&drive.wind[3 * k])};
    if (!drive.roots.empty()) {
        for (int end = 0; end < 2; ++end) roots[end] = root_pose(drive, k + end, S, index);
        interval.skin.roots = roots;
    }
    if (drive.deformation) {
        interval.skin.deformation = drive.deformation.get();
        for (int end = 0; end < 2; ++end) interval.skin.blend[end] = drive.blend[k + end];
    }
    return interval;
}

struct Report {
    double strain = 0, depth = 0, rounds = 0, contacts = 0, solves = 0;
    int rounds_max = 0;
    long halvings = 0;
    int bad_strand = -1;
    double seconds = 0, neighbour_seconds = 0; // wall time of the call, and of hair-hair contact in it
};

template <class Real>
void read(Motion<Real> &motion, const StateArrays<Real> &state, int P, const BlockIndex<Real> &index) {
    gather(motion.x, state.points, P, index.strand);
    gather(motion.v, state.velocity, P, index.strand);
    gather<Real>(motion.T, state.tension, P - 1, P - 1, index.strand);
    gather<Real>(motion.touch, state.contact, P, P, index.strand);
    gather(motion.m, state.directors, P - 1, index.strand);
    gather<Real>(motion.twist + 1, state.twist, P - 2, P - 2, index.strand);
}

template <class Real>
void write(const Motion<Real> &motion, StateArrays<Real> &state, int P, const BlockIndex<Real> &index) {
    scatter(motion.x, state.points, P, index);
    scatter(motion.v, state.velocity, P, index);
    scatter<Real>(motion.T, state.tension, P - 1, index);
    scatter<Real>(motion.touch, state.contact, P, index);
    scatter(motion.m, state.directors, P - 1, index);
    scatter<Real>(motion.twist + 1, state.twist, P - 2, index);
}

/// The first strand of a block that is torn, a segment half as long again or half as short as it should be, or that has
/// a number that is not finite; -1 where there is none.
template <class Real>
int first_bad_strand(const Block<Real> &b, const Motion<Real> &motion, const BlockIndex<Real> &index) {
    const Lanes<Real> most = splat(std::numeric_limits<Real>::max()), none = splat(Real(0));
    Mask<Real> good = none == none;
    for (int i = 0; i < b.P; ++i) {
        for (Lanes<Real> v : {motion.v[i].x, motion.v[i].y, motion.v[i].z}) good &= (v <= most) & (v >= -most);
        if (i == b.P - 1) break;
        const Vec3<Real> edge = motion.x[i + 1] - motion.x[i];
        const Lanes<Real> part = dot(edge, edge) * b.inverse_l[i] * b.inverse_l[i];
        good &= (part > Real(kShort * kShort)) & (part < Real(kLong * kLong));
    }
    for (int lane = 0; lane < index.count; ++lane)
        if (!good[lane]) return index.begin + lane;
    return -1;
}

/// Lanes that hold a strand of their own (the last block repeats its last strand).
template <class Real> Mask<Real> own_lanes(const BlockIndex<Real> &index) {
    Mask<Real> own{};
    for (int lane = 0; lane < index.count; ++lane) own[lane] = -1;
    return own;
}

/// Steps one block of strands through the whole drive.
template <class Real>
void advance_block(Stepper<Real> &stepper, const BlockIndex<Real> &index, StateArrays<Real> &state,
                   const RestShape &rest, const Drive &drive, const StepSettings &settings) {
    stepper.tally = {};
    read(stepper.block, rest, index, settings.torsion != Torsion::kirchhoff);
    choose_theta(stepper.block, settings);
    read(stepper.now, state, rest.P, index);
    stepper.contacts.forget(rest.P);
    RootPose<Real> roots[2];
    for (int k = 0; k < drive.steps; ++k)
        stepper.step(interval_of(drive, k, settings, rest.S, index, roots), own_lanes(index));
    stepper.tally.bad_strand = first_bad_strand(stepper.block, stepper.now, index);
    write(stepper.now, state, rest.P, index);
}

/// Adds up the tallies of all blocks, in order.
template <class Real> Report summarise(const std::vector<Tally<Real>> &tallies, int steps) {
    Report report;
    const double block_steps = std::max(1.0, double(tallies.size()) * steps);
    for (const Tally<Real> &tally : tallies) {
        report.strain = std::max(report.strain, double(largest<Real>(tally.strain)));
        report.depth = std::max(report.depth, double(largest<Real>(tally.depth)));
        report.rounds += tally.rounds / block_steps;
        report.solves += tally.solves / block_steps;
        report.contacts += tally.contacts / std::max(1, steps);
        report.halvings += tally.halvings;
        report.rounds_max = std::max(report.rounds_max, tally.rounds_max);
        if (report.bad_strand < 0) report.bad_strand = tally.bad_strand;
    }
    return report;
}

/// Advances the state in place by the steps of the drive.
template <class Real>
Report advance(StateArrays<Real> state, const RestShape &rest, const DistanceField *field, const Drive &drive,
               const StepSettings &settings, int threads) {
    const int blocks = block_count<Real>(rest.S);
    std::vector<Tally<Real>> tallies(blocks);
#pragma omp parallel num_threads(threads)
    {
        Arena arena(Stepper<Real>::bytes(rest.P));
        Stepper<Real> stepper(arena, rest.P, settings, field);
#pragma omp for schedule(dynamic, 1)
        for (int block = 0; block < blocks; ++block) {
            advance_block(stepper, BlockIndex<Real>(block, rest.S), state, rest, drive, settings);
            tallies[block] = stepper.tally;
        }
    }
    return summarise(tallies, drive.steps);
}

} // namespace ringlet
