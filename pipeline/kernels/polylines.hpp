// Polylines: their points at places between points, cut to a length, gathered towards the middle of a lock.
#pragma once

#include <algorithm>
#include <cmath>
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

/// Points at `count` equal parts of the first `length` of a polyline of P points.
inline void cut_to(const double *points, int P, double length, int count, double *out) {
    double before = 0, segment = 0; // arc length to point i, and from there to the next
    int i = -1;
    for (int j = 0; j < count; ++j, out += 3) {
        const double s = length * j / (count - 1);
        while (i < 0 || (s > before + segment && i + 2 < P)) {
            before += segment, ++i;
            double square = 0;
            for (int k = 0; k < 3; ++k) square += (points[3 * i + 3 + k] - points[3 * i + k]) * (points[3 * i + 3 + k] - points[3 * i + k]);
            segment = std::sqrt(square);
        }
        const double u = std::clamp((s - before) / std::max(segment, 1e-12), 0.0, 1.0);
        for (int k = 0; k < 3; ++k) out[k] = points[3 * i + k] * (1 - u) + points[3 * i + 3 + k] * u;
    }
}

/// Where strands are cut: outside of the half space n . x + d <= 0, or of a sphere.
struct Cut {
    double n[3], d; // normal and offset, or centre and radius
    bool round;
    double hang; // height below which a strand is measured as if it hung straight down; -infinity: as it lies
};

/// Arc length at which a polyline of P points first comes outside by more than `margin`; all of it where it does not.
inline double first_outside(const double *points, int P, double margin, const Cut &cut) {
    double along = 0, last = 0, hung = -1; // arc length to the point before, its distance outside, where it hangs from
    for (int i = 0; i < P; ++i) {
        const double *p = points + 3 * size_t(i);
        double step = 0;
        if (i > 0)
            for (int k = 0; k < 3; ++k) step += (p[k] - p[k - 3]) * (p[k] - p[k - 3]);
        step = std::sqrt(step);
        if (hung < 0 && p[1] < cut.hang) hung = along + step;
        const double height = hung < 0 ? p[1] : std::min(p[1], cut.hang - (along + step - hung));
        double outside;
        if (cut.round) {
            const double x = p[0] - cut.n[0], y = height - cut.n[1], z = p[2] - cut.n[2];
            outside = std::sqrt(x * x + y * y + z * z) - cut.d - margin;
        } else {
            outside = cut.n[0] * p[0] + cut.n[1] * height + cut.n[2] * p[2] + cut.d - margin;
        }
        if (outside > 0) return i == 0 ? 0 : along + step * std::clamp(-last / std::max(outside - last, 1e-9), 0.0, 1.0);
        along += step, last = outside;
    }
    return along;
}

/// The middles of locks: M polylines of Q points at equal parts of their lengths.
struct Middles {
    const double *points, *length;
    int Q;
};

/// How a strand is drawn: from arc length `begin` on by strength * smoothstep((s - begin) / over), towards the middle's
/// point at arc length s + shift.
struct Pull {
    double strength, over, begin, shift;
};

inline void draw_in(const double *points, int P, double length, const Middles &middles, int64_t lock, const Pull &pull,
                    double *out) {
    const double *middle = middles.points + size_t(lock) * middles.Q * 3, per_length = (middles.Q - 1) / middles.length[lock];
    for (int j = 0; j < P; ++j) {
        const double s = length * j / (P - 1), t = std::clamp((s - pull.begin) / pull.over, 0.0, 1.0);
        const double weight = pull.strength * t * t * (3 - 2 * t);
        double target[3];
        point_at(middle, middles.Q, (s + pull.shift) * per_length, target);
        for (int k = 0; k < 3; ++k) out[3 * j + k] = points[3 * j + k] + weight * (target[k] - points[3 * j + k]);
    }
}

} // namespace ringlet
