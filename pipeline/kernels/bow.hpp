// Strands pressed between two held points: what inextensible hair does when its ends come nearer.
//
// A strand that is exactly straight has no first-order way to give way to a shorter distance of its ends: the length
// relaxation is singular there. Real hair bows out to the side that is least loaded. With S the length of the strand
// between two held points and D their distance, a flat sine bow of amplitude A has
//     S = D + pi^2 A^2 / (4 D)      so that      A = 2/pi sqrt((S - D) D)
#pragma once

#include "block.hpp"

namespace ringlet {

/// One lane's points between two held ones, and their total length.
struct Run {
    int begin, end; // held points with free ones between them
    double length;
};

/// Calls f for every run of a lane.
template <class Real, class F> void for_each_run(const Block<Real> &b, int lane, const F &f) {
    int held = -1;
    double length = 0;
    for (int i = 0; i < b.P; ++i) {
        if (i > 0) length += double(b.l[i - 1][lane]);
        if (b.free[i][lane] > 0) continue;
        if (held >= 0 && i > held + 1) f(Run{held, i, length});
        held = i, length = 0;
    }
}

template <class Real> Vec lane_of(Vec3<Real> a, int lane) { return {a.x[lane], a.y[lane], a.z[lane]}; }

template <class Real> void move_lane(Vec3<Real> &a, int lane, Vec by) {
    a.x[lane] += Real(by.x), a.y[lane] += Real(by.y), a.z[lane] += Real(by.z);
}

/// The unit vector across a unit axis that is nearest to a wanted direction; any one where that lies along the axis.
inline Vec across(Vec axis, Vec wanted) {
    Vec side = wanted - dot(wanted, axis) * axis;
    if (norm(side) > 1e-6 * norm(wanted)) return (1 / norm(side)) * side;
    const Vec other = std::abs(axis.x) < 0.6 ? Vec{1, 0, 0} : Vec{0, 1, 0};
    side = other - dot(other, axis) * axis;
    return (1 / norm(side)) * side;
}

/// Bows out what is straight and pressed in these lanes, by `down`, as far as its length asks for.
template <class Real> void bow_out(const Block<Real> &b, Vec3<Real> down, Mask<Real> lanes, Vec3<Real> *x) {
    constexpr double pi = 3.14159265358979323846;
    for (int lane = 0; lane < kLanes<Real>; ++lane) {
        if (!lanes[lane]) continue;
        for_each_run(b, lane, [&](const Run &run) {
            const Vec begin = lane_of(x[run.begin], lane), chord = lane_of(x[run.end], lane) - begin;
            const double distance = norm(chord), slack = run.length - distance;
            if (!(slack > 0) || !(distance > 0)) return;
            const double height = 2 / pi * std::sqrt(slack * distance), slope = pi * height / distance;
            const Vec axis = (1 / distance) * chord;
            for (int i = run.begin; i < run.end; ++i) {
                const Vec edge = lane_of(x[i + 1], lane) - lane_of(x[i], lane);
                if (!(norm(cross(edge, axis)) < 0.1 * slope * norm(edge))) return; // bent already
            }
            const Vec side = across(axis, lane_of(down, lane));
            for (int i = run.begin + 1; i < run.end; ++i) {
                const double along = dot(lane_of(x[i], lane) - begin, axis) / distance;
                move_lane(x[i], lane, (height * std::sin(pi * along)) * side);
            }
        });
    }
}

/// Closes the runs of lanes that moved with their root, by a shift that grows towards the second held point. `before`
/// are the points from which they moved.
template <class Real> void close_runs(const Block<Real> &b, const Vec3<Real> *before, Mask<Real> lanes, Vec3<Real> *x) {
    for (int lane = 0; lane < kLanes<Real>; ++lane) {
        if (!lanes[lane]) continue;
        for_each_run(b, lane, [&](const Run &run) {
            const Vec edge = lane_of(before[run.end], lane) - lane_of(before[run.end - 1], lane);
            const Vec gap = lane_of(x[run.end], lane) - lane_of(x[run.end - 1], lane) - edge;
            const double per_point = 1.0 / (run.end - run.begin);
            for (int i = run.begin + 1; i < run.end; ++i) move_lane(x[i], lane, ((i - run.begin) * per_point) * gap);
        });
    }
}

} // namespace ringlet
