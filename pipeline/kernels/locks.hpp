// Points of polylines at fractions of their points, and strands gathered towards the middle strand of their lock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ringlet {

/// Point of a polyline of P points at a fractional point index; straight on past the tip, by 4 segments at most.
inline void point_at(const double *points, int P, double place, double *to) {
    place = place > 0 ? std::min(place, P + 3.0) : 0;
    const int i = std::min(int(place), P - 2);
    const double u = place - i, *a = points + 3 * size_t(i);
    for (int k = 0; k < 3; ++k) to[k] = a[k] * (1 - u) + a[3 + k] * u;
}

/// The middles of locks: M polylines of Q points at equal parts of their lengths.
struct Middles {
    const double *points, *length;
    int Q;
};

/// Moves a strand's points towards the middle's at the same arc length, by strength * smoothstep(s / over).
inline void draw_in(const double *points, int P, double length, const Middles &middles, int64_t lock, double strength,
                    double over, double *out) {
    const double *middle = middles.points + size_t(lock) * middles.Q * 3, per_length = (middles.Q - 1) / middles.length[lock];
    for (int j = 0; j < P; ++j) {
        const double s = length * j / (P - 1), t = std::clamp(s / over, 0.0, 1.0), weight = strength * t * t * (3 - 2 * t);
        double target[3];
        point_at(middle, middles.Q, s * per_length, target);
        for (int k = 0; k < 3; ++k) out[3 * j + k] = points[3 * j + k] + weight * (target[k] - points[3 * j + k]);
    }
}

} // namespace ringlet
