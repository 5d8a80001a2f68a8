// Expansion: strands from guides by tangent rotation, a lane per strand.
//
// Notation: e_j segment j of a strand at rest; A_g(s) rotation of guide g at arc length s since rest (guide_motion.hpp),
// w_g weights of the strand's guides, the nearest first; phi distance to the head. Everything happens in the head's
// rest frame and is carried to the world at the end:
//     x_0 = root,    x_{j+1} = x_j + R_j e_j,    R_j = normalised sum_g w_g A_g(s_j).
// Where the skin deforms, x_0 is where it has carried the root, and phi the distance of the moment.
// A rotation keeps lengths, so a strand has its own length whatever R is, and its rest shape where R is the identity.
// Source: Hsu et al., "Real-time Physically Guided Hair Interpolation" (ACM TOG 43, 2024) for why positions must not be
// blended; we blend rotations instead of their forces (tests: error against a rod solver, chunks, lengths).
#pragma once

#include "between.hpp"
#include "block.hpp"
#include "distance_field.hpp"
#include "guide_motion.hpp"
#include "patches.hpp"
#include "vary.hpp"

namespace ringlet {

/// The full count of strands; columns as in `pipeline.strands.expand.Binding`.
struct BoundStrands {
    int N, k;
    const uint32_t *parent;
    const float *root;
    const uint32_t *guide;
    const float *weight;
    const uint32_t *key;
    const float *scale, *phase;
    const std::vector<uint16_t> *order; // see patches.hpp
};

inline constexpr int kGuidesMax = 8;

/// A rotation of each strand of a block; not normalised.
struct Rotation {
    Lanes<float> w;
    Vec3<float> u;

    friend RINGLET_INLINE Lanes<float> dot(const Rotation &a, const Rotation &b) { return a.w * b.w + dot(a.u, b.u); }

    RINGLET_INLINE Vec3<float> turn(Vec3<float> a) const {
        const Vec3<float> c = cross(u, a);
        return a + (2 * reciprocal<float>(dot(*this, *this))) * (w * c + cross(u, c));
    }
};

/// The guides that the strands of a block follow.
struct Followed {
    int count;
    Mask<float> row[kGuidesMax]; // first rotation of the guide
    Lanes<float> weight[kGuidesMax], step[kGuidesMax]; // step: the strand's spacing in spacings of the guide
};

/// A_g where segment j of the strand is, between two segments of the guide; beyond the guide's tip its last one.
RINGLET_INLINE Rotation rotation_at(const GuideMotion &motion, const Followed &to, int g, int j) {
    const Lanes<float> last = splat(float(motion.Q - 2)), u = (j + 0.5f) * to.step[g] - 0.5f;
    const Lanes<float> v = minimum<float>(u > 0 ? u : Lanes<float>{}, last);
    const Mask<float> i = __builtin_convertvector(minimum<float>(v, last - 1), Mask<float>);
    const Lanes<float> f = v - __builtin_convertvector(i, Lanes<float>);
    const Four q = read_between(motion.rotations.data(), to.row[g] + i, f);
    return {q.part[0], {q.part[1], q.part[2], q.part[3]}};
}

/// R_j, a multiple of it. A guide whose rotation differs from the nearest one's by more than 60 degrees has parted
/// from it, and a mean of the two would lie in the gap: its weight fades out between 45 and 75 degrees.
RINGLET_INLINE Rotation blended(const GuideMotion &motion, const Followed &to, int j) {
    constexpr float kApart = 0.62941f, kTogether = 0.85355f; // cos^2 of half of 75 and 45 degrees
    const Rotation nearest = rotation_at(motion, to, 0, j);
    const Lanes<float> square = dot(nearest, nearest);
    Rotation sum{to.weight[0] * nearest.w, to.weight[0] * nearest.u};
    for (int g = 1; g < to.count; ++g) {
        const Rotation other = rotation_at(motion, to, g, j);
        const Lanes<float> c = dot(nearest, other), cos2 = c * c * reciprocal<float>(square * dot(other, other));
        Lanes<float> near = (cos2 - kApart) * (1 / (kTogether - kApart));
        near = minimum<float>(maximum<float>(near, Lanes<float>{}), splat(1.0f));
        Lanes<float> weight = to.weight[g] * near * near * (3 - 2 * near);
        weight = c < 0 ? -weight : weight; // q and -q are one rotation
        sum.w += weight * other.w;
        sum.u = sum.u + weight * other.u;
    }
    return sum;
}

/// Keeps segments out of the head. The distance that must be kept grows from the root's own, at most a quarter of the
/// arc length, so that a strand can always leave the skin, and a root below it comes out gently.
class Skin {
  public:
    Skin(const DistanceField &field, float skin, Vec3<float> root) : field_(field), skin_(skin) {
        Vec3<float> gradient;
        sample<float>(field, root, at_root_, gradient);
        bound_ = at_root_;
    }

    /// Tilts the segment t of length `whole` from x away from the head so that its end, at arc length s, is outside, and
    /// its middle too: an ear is thinner than a segment is long.
    RINGLET_INLINE Vec3<float> clear(Vec3<float> x, Vec3<float> t, Lanes<float> whole, Lanes<float> s) {
        const Lanes<float> half = 0.5f * whole, start = bound_;
        t = ended(x, t, whole, s);
        const Lanes<float> higher = maximum<float>(start, bound_);
        if (!any<float>((higher < float(field_.steepest) * half) & (whole > kShort))) return t;
        return any<float>(lower_bound(field_, x + splat(0.5f) * t) < -kCurved) ? over(x, t, whole, s) : t;
    }

  private:
    /// The segment whose end is outside.
    RINGLET_INLINE Vec3<float> ended(Vec3<float> x, Vec3<float> t, Lanes<float> whole, Lanes<float> s) {
        // phi cannot fall faster than its steepest slope: most points need no sample
        const Lanes<float> keep = minimum<float>(splat(skin_), at_root_ + kRise * s);
        bound_ -= float(field_.steepest) * whole;
        Mask<float> near = bound_ < keep;
        if (!any<float>(near)) return t;
        bound_ = maximum<float>(bound_, lower_bound(field_, x + t));
        near = bound_ < keep;
        for (int round = 0; round < kRounds && any<float>(near); ++round) {
            Lanes<float> phi;
            Vec3<float> gradient;
            sample<float>(field_, x + t, phi, gradient);
            bound_ = phi;
            const Lanes<float> depth = keep - phi;
            near &= depth > 0;
            if (!any<float>(near)) break;
            t = select(near, tilted(t, whole, gradient, depth), t);
            near &= depth > kCurved;
            if (round == kCareful - 1 && any<float>(near)) {
                sample<float>(field_, x, phi, gradient);
                t = select(near, (whole / (length(gradient) + 1e-12f)) * gradient, t);
            }
        }
        return t;
    }

    /// The segment whose middle is outside too, as good as it can be.
    __attribute__((noinline)) Vec3<float> over(Vec3<float> x, Vec3<float> t, Lanes<float> whole, Lanes<float> s) {
        const Lanes<float> half = 0.5f * whole, keep = minimum<float>(at_root_ + kRise * (s - half), Lanes<float>{});
        Mask<float> cut = whole > kShort;
        for (int round = 0; round < kCareful; ++round) {
            Lanes<float> phi;
            Vec3<float> gradient;
            sample<float>(field_, x + splat(0.5f) * t, phi, gradient);
            cut &= phi < keep - kCurved;
            if (!any<float>(cut)) break;
            Vec3<float> lifted = tilted(t, whole, gradient, 2 * (keep - phi));
            if (round == kCareful - 1) {
                sample<float>(field_, x, phi, gradient);
                lifted = (whole / (length(gradient) + 1e-12f)) * gradient;
            }
            const Lanes<float> others = bound_;
            bound_ = cut ? splat(-1.0f) : splat(1.0f); // where all ends are looked at, and where none is
            t = select(cut, ended(x, lifted, whole, s), t);
            bound_ = cut ? bound_ : others;
        }
        return t;
    }

    static constexpr float kRise = 0.25f;
    static constexpr float kShort = 2e-3f;     // [m]: what is thinner than that is no ear
    static constexpr int kCareful = 4;         // rounds; one is exact over a plane. In folds of the skin, as behind an
    static constexpr int kRounds = 8;          // ear, what is nearest changes with each: who is not out then stands up
    static constexpr float kCurved = 0.1e-3f;  // [m]: from less depth one is exact over any head

    /// The segment whose end is higher by `rise`, turned in the plane of itself and the normal; upright at most.
    static RINGLET_INLINE Vec3<float> tilted(Vec3<float> t, Lanes<float> whole, Vec3<float> gradient, Lanes<float> rise) {
        const Lanes<float> tiny = splat(1e-12f);
        const Vec3<float> n = (1 / (length(gradient) + tiny)) * gradient;
        const Vec3<float> d = (1 / (whole + tiny)) * t;
        const Lanes<float> up = dot(d, n), wanted = minimum<float>(up + rise / (whole + tiny), splat(1.0f));
        const Vec3<float> flat = d - up * n;
        const Lanes<float> along = square_root<float>(1 - wanted * wanted) / (length(flat) + tiny);
        const Vec3<float> to = wanted * n + along * flat;
        const Lanes<float> size = length(to);
        return whole * select(size > 0.5f, (1 / (size + tiny)) * to, n);
    }

    const DistanceField &field_;
    float skin_;
    Lanes<float> at_root_, bound_; // phi at the root; a lower bound of phi at the current point
};

/// Asks for memory before it is read, or written: whoever then comes for it need not wait.
template <bool write = false, class T> RINGLET_INLINE void fetch(const T *from, size_t count) {
    constexpr size_t line = 64;
    const char *first = reinterpret_cast<const char *>(from);
    for (size_t byte = 0; byte < count * sizeof(T); byte += line) __builtin_prefetch(first + byte, write, 3);
}

/// What a thread needs for a block.
struct ExpandScratch {
    Arena arena;
    Vec3<float> *x, *e;
    Lanes<float> *whole; // lengths of the e

    explicit ExpandScratch(int P)
        : arena(size_t(7 * P + 8) * sizeof(Lanes<float>)), x(arena.take<Vec3<float>>(P)), e(arena.take<Vec3<float>>(P)),
          whole(arena.take<Lanes<float>>(P)) {}
};

/// One call: the groom (., P, 3), the strands and what moves them.
struct Expand {
    const float *rest;
    int P;
    const BoundStrands &strands;
    const GuideMotion &motion;
    const DistanceField *field; // may be null
    const float *place;         // (N, 3) roots of the moment; null where they are as at rest
    ExpandStyle style;

    /// Points of strands begin .. begin+count to out (count, P, 3).
    void run(int begin, int count, float *out, int threads) const {
        const std::vector<int> taken = taken_in_patches(*strands.order, size_t(begin), size_t(count));
        const int blocks = block_count<float>(count);
#pragma omp parallel num_threads(threads)
        {
            ExpandScratch scratch(P);
#pragma omp for schedule(dynamic, 32)
            for (int b = 0; b < blocks; ++b) {
                const BlockIndex<float> index(b, count);
                int strand[kLanes<float>], row[kLanes<float>];
                for (int lane = 0; lane < kLanes<float>; ++lane) {
                    strand[lane] = taken[index.strand[lane]];
                    row[lane] = strand[lane] - begin;
                    fetch<true>(out + size_t(row[lane]) * 3 * P, 3 * P);
                }
                fetch_ahead(taken, (b + 1) * kLanes<float>);
                block(strand, scratch);
                scatter<float>(&scratch.x->x, out, 3 * P, row, index.count);
            }
        }
    }

  private:
    /// Asks for what the strands taken from `first` on are made of: they lie all over the memory of their tile, and those
    /// of the block after them are asked for their parents.
    void fetch_ahead(const std::vector<int> &taken, size_t first) const {
        constexpr size_t n = kLanes<float>;
        for (size_t i = first; i < std::min(first + n, taken.size()); ++i)
            fetch(rest + size_t(strands.parent[taken[i]]) * 3 * P, 3 * P);
        for (size_t i = first + n; i < std::min(first + 2 * n, taken.size()); ++i) {
            const size_t s = size_t(taken[i]), k = size_t(strands.k);
            fetch(strands.parent + s, 1), fetch(strands.root + 3 * s, 3), fetch(strands.key + s, 1);
            fetch(strands.guide + s * k, k), fetch(strands.weight + s * k, k);
            fetch(strands.scale + s, 1), fetch(strands.phase + s, 1);
            if (place) fetch(place + 3 * s, 3);
        }
    }

    /// Points of a block of strands to scratch.x.
    void block(const int (&strand)[kLanes<float>], const ExpandScratch &scratch) const {
        Vec3<float> *x = scratch.x, *e = scratch.e, root;
        const Lanes<float> *whole = scratch.whole;
        gather(&root, strands.root, 1, strand);
        segments(strand, root, scratch);
        Lanes<float> sum{};
        for (int j = 0; j + 1 < P; ++j) sum += whole[j];
        const Lanes<float> spacing = sum * (1.0f / (P - 1));
        const Followed to = followed(strand, spacing);
        if (place) gather(&root, place, 1, strand);
        x[0] = root;
        if (field) {
            Skin skin(*field, style.skin, root);
            for (int j = 0; j + 1 < P; ++j)
                x[j + 1] = x[j] + skin.clear(x[j], blended(motion, to, j).turn(e[j]), whole[j], (j + 1.0f) * spacing);
        } else {
            for (int j = 0; j + 1 < P; ++j) x[j + 1] = x[j] + blended(motion, to, j).turn(e[j]);
        }
        const Rigid<float> to_world(motion.pose);
        for (int j = 0; j < P; ++j) x[j] = to_world(x[j]);
    }

    /// Segments e at rest, of groom strands as they are and of copies varied; x is used for the parents' points.
    void segments(const int (&strand)[kLanes<float>], Vec3<float> root, const ExpandScratch &scratch) const {
        Vec3<float> *x = scratch.x, *e = scratch.e;
        int parent[kLanes<float>];
        Copies copies{};
        bool some = false;
        for (int lane = 0; lane < kLanes<float>; ++lane) {
            const int s = strand[lane];
            parent[lane] = int(strands.parent[s]);
            const bool copy = parent[lane] != s;
            copies.varied[lane] = copy ? -1 : 0;
            copies.key[lane] = strands.key[s];
            copies.scale[lane] = strands.scale[s];
            copies.cosine[lane] = copy ? std::cos(strands.phase[s]) : 1;
            copies.sine[lane] = copy ? std::sin(strands.phase[s]) : 0;
            some |= copy;
        }
        gather(x, rest, P, parent);
        for (int j = 0; j + 1 < P; ++j) e[j] = x[j + 1] - x[j], scratch.whole[j] = length(e[j]);
        copies.offset = root - x[0];
        if (some) vary(e, scratch.whole, x, P, copies, style);
    }

    Followed followed(const int (&strand)[kLanes<float>], Lanes<float> spacing) const {
        Followed to;
        to.count = strands.k;
        for (int g = 0; g < to.count; ++g)
            for (int lane = 0; lane < kLanes<float>; ++lane) {
                const size_t at = size_t(strand[lane]) * strands.k + g;
                const int guide = int(strands.guide[at]);
                to.row[g][lane] = guide * (motion.Q - 1);
                to.weight[g][lane] = strands.weight[at];
                to.step[g][lane] = spacing[lane] / motion.spacing[guide];
            }
        return to;
    }
};

} // namespace ringlet
