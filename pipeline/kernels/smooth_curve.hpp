// The smooth curve through the points of a strand, and points at equal spacing on it; a lane per strand.
//
// The curve is the natural cubic spline over chord lengths. Points at equal spacing: all chords c_k between them agree.
// Newton's method on c_{k+1} - c_k = 0, whose matrix is tridiagonal: c_k grows with t_k at the rate e_k . x'(t_k), and
// falls with t_{k-1} at the rate e_k . x'(t_{k-1}), e_k the chord's direction.
// Notation: x points, t parameter [m], h its step from point to point, M second derivative at the points, u the
// parameter from the start of a segment.
#pragma once

#include "block.hpp"
#include "lane_rows.hpp"

namespace ringlet {

using Lane = Lanes<double>;
using Point = Vec3<double>;

/// On each segment a cubic: value[0] + u (value[1] + u (value[2] + u value[3])).
struct Cubic {
    Point value[4];
};

/// What a block of strands needs: P points in, Q out.
struct CurveScratch {
    Arena arena;
    Point *x, *M;
    Cubic *cubic;
    Lane *t, *ratio;                                  // of the P points
    Point *found, *slope;                             // of the Q points on the curve
    Lane *at, *before, *after, *chord, *change, *eliminated;

    CurveScratch(int P, int Q)
        : arena(size_t(P) * (2 * sizeof(Point) + sizeof(Cubic) + 2 * sizeof(Lane)) +
                size_t(Q) * (2 * sizeof(Point) + 6 * sizeof(Lane))),
          x(arena.take<Point>(P)), M(arena.take<Point>(P)), cubic(arena.take<Cubic>(P)), t(arena.take<Lane>(P)),
          ratio(arena.take<Lane>(P)), found(arena.take<Point>(Q)), slope(arena.take<Point>(Q)) {
        for (Lane **array : {&at, &before, &after, &chord, &change, &eliminated}) *array = arena.take<Lane>(Q);
    }
};

class SmoothCurve {
  public:
    /// Through the points x that the scratch holds; P >= 2.
    SmoothCurve(const CurveScratch &scratch, int P) : s_(scratch), P_(P) {
        constexpr double kSmallest = 1e-12; // [m] keeps a step that does not exist from being divided by
        s_.t[0] = Lane{};
        for (int j = 0; j + 1 < P; ++j) {
            const Point chord = s_.x[j + 1] - s_.x[j];
            const Lane length = square_root<double>(dot(chord, chord)), h = maximum<double>(length, splat(kSmallest));
            s_.t[j + 1] = s_.t[j] + length;
            s_.cubic[j].value[0] = s_.x[j];
            s_.cubic[j].value[1] = (1 / h) * chord;
            s_.cubic[j].value[2].x = h;
        }
        second_derivative();
        for (int j = 0; j + 1 < P; ++j) {
            Cubic &cubic = s_.cubic[j];
            const Lane h = cubic.value[2].x;
            const Point start = s_.M[j], end = s_.M[j + 1];
            cubic.value[1] = cubic.value[1] - (h / 6) * (splat(2.0) * start + end);
            cubic.value[2] = splat(0.5) * start;
            cubic.value[3] = (1 / (6 * h)) * (end - start);
        }
    }

    /// Moves the points found, and their slopes, to the Q ascending parameters `at`.
    void evaluate(int Q) const {
        Mask<double> segment{};
        for (int k = 0; k < Q; ++k) {
            const Lane t = s_.at[k];
            for (Mask<double> past; any<double>(past = (segment < P_ - 2) & (pick<1>(s_.t, segment + 1) <= t));) segment -= past;
            const Lane u = t - pick<1>(s_.t, segment);
            const Point a = pick<4>(s_.cubic->value, segment), b = pick<4>(s_.cubic->value + 1, segment),
                        c = pick<4>(s_.cubic->value + 2, segment), d = pick<4>(s_.cubic->value + 3, segment);
            s_.found[k] = a + u * (b + u * (c + u * d));
            s_.slope[k] = b + u * (splat(2.0) * c + (3 * u) * d);
        }
    }

  private:
    /// h_{j-1} M_{j-1} + 2 (h_{j-1} + h_j) M_j + h_j M_{j+1} = 6 (slope_j - slope_{j-1}), zero at both ends.
    void second_derivative() {
        const auto h = [&](int j) RINGLET_ALWAYS { return s_.cubic[j].value[2].x; };
        s_.M[0] = s_.M[P_ - 1] = Point{};
        s_.ratio[0] = Lane{};
        for (int j = 1; j + 1 < P_; ++j) { // eliminate downwards
            const Lane inverse = 1 / (2 * (h(j - 1) + h(j)) - h(j - 1) * s_.ratio[j - 1]);
            s_.ratio[j] = h(j) * inverse;
            s_.M[j] = inverse * (splat(6.0) * (s_.cubic[j].value[1] - s_.cubic[j - 1].value[1]) - h(j - 1) * s_.M[j - 1]);
        }
        for (int j = P_ - 2; j > 0; --j) s_.M[j] = s_.M[j] - s_.ratio[j] * s_.M[j + 1]; // substitute back
    }

    const CurveScratch &s_;
    int P_;
};

/// Finds Q points at equal spacing on the curve; those of a lane that has settled stay.
class EqualChords {
  public:
    EqualChords(const CurveScratch &scratch, int P, int Q) : s_(scratch), Q_(Q) {
        const SmoothCurve curve(scratch, P);
        const Lane whole = s_.t[P - 1];
        for (int k = 0; k < Q; ++k) s_.at[k] = whole * (double(k) / (Q - 1));
        s_.at[Q - 1] = whole;
        curve.evaluate(Q);
        for (int round = 0; round < kRounds; ++round) {
            const Mask<double> left = unequal();
            if (!any<double>(left)) break;
            improve(left);
            curve.evaluate(Q);
        }
    }

  private:
    static constexpr int kRounds = 40;
    static constexpr double kEqual = 3e-7;  // of a segment's length; two of its ends make 6e-7
    static constexpr double kSlowest = 0.3; // least rate at which a chord may be taken to change
    static constexpr double kFarthest = 0.45; // of the way to the next point that a round goes

    /// Measures chords; tells which lanes have points that are not where equal chords want them.
    Mask<double> unequal() const {
        Lane whole{};
        for (int k = 1; k < Q_; ++k) {
            const Point e = s_.found[k] - s_.found[k - 1];
            const Lane chord = square_root<double>(dot(e, e));
            const Point direction = (1 / maximum<double>(chord, splat(1e-300))) * e;
            s_.chord[k] = chord;
            s_.before[k] = maximum<double>(dot(direction, s_.slope[k - 1]), splat(kSlowest));
            s_.after[k] = maximum<double>(dot(direction, s_.slope[k]), splat(kSlowest));
            whole += chord;
        }
        const Lane wanted = whole / double(Q_ - 1);
        Lane along{}, worst{};
        for (int k = 1; k < Q_; ++k) {
            along += s_.chord[k];
            const Lane off = along - wanted * double(k);
            worst = maximum<double>(worst, off < 0 ? -off : off);
        }
        return worst > kEqual * wanted;
    }

    /// One step of Newton's method in the lanes that are left; parameters stay in order.
    void improve(Mask<double> left) const {
        Lane &none = s_.change[0], &last = s_.change[Q_ - 1];
        none = last = s_.eliminated[0] = Lane{};
        for (int k = 1; k + 1 < Q_; ++k) {
            const Lane pivot = s_.after[k] + s_.before[k + 1] - s_.before[k] * s_.eliminated[k - 1];
            const Lane inverse = 1 / pivot;
            s_.eliminated[k] = s_.after[k + 1] * inverse;
            s_.change[k] = (s_.chord[k + 1] - s_.chord[k] + s_.before[k] * s_.change[k - 1]) * inverse;
        }
        for (int k = Q_ - 2; k > 0; --k) s_.change[k] += s_.eliminated[k] * s_.change[k + 1];
        Lane previous = s_.at[0];
        for (int k = 1; k + 1 < Q_; ++k) {
            const Lane here = s_.at[k], back = kFarthest * (previous - here), ahead = kFarthest * (s_.at[k + 1] - here);
            const Lane moved = here + minimum<double>(maximum<double>(s_.change[k], back), ahead);
            previous = here;
            s_.at[k] = select<double>(left, moved, here);
        }
    }

    const CurveScratch &s_;
    int Q_;
};

/// Points (S, P, 3) as (S, Q, 3) at equal spacing along the smooth curve through them; P, Q >= 2.
inline void resample(const double *points, int S, int P, int Q, double *out, int threads) {
    const int blocks = block_count<double>(S);
#pragma omp parallel num_threads(threads)
    {
        const CurveScratch scratch(P, Q);
#pragma omp for schedule(dynamic, 16)
        for (int b = 0; b < blocks; ++b) {
            const BlockIndex<double> index(b, S);
            gather(scratch.x, points, P, index.strand);
            EqualChords(scratch, P, Q);
            scatter(scratch.found, out, Q, index);
        }
    }
}

} // namespace ringlet
