// One hair fibre seen from afar: S = sum over the lobes R, TT, TRT and rest of M_p (along) N_p (around).
//
// M_p(theta_i, theta_o) = exp(-sin ti sin to / v) I0(cos ti cos to / v) / (2 v sinh(1/v)): d'Eon et al., An
// Energy-Conserving Hair Reflectance Model, EGSR 2011. N_p and its sums come from tables (pipeline/render/fibre.py), and
// so do colour and roughness along a strand (pipeline/render/pigment.py).
#pragma once

#include "elementary.hpp"

#include <cstddef>

namespace ringlet {

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));

/// One lobe's variance v, as M needs it.
struct Lobe {
    Floats inverse, norm; // 1 / v and 1 / (v (1 - e^(-2/v)))

    Lobe() = default;
    RINGLET_INLINE explicit Lobe(Floats v) : inverse(1.0f / v), norm(inverse / (1.0f - exponential(-2.0f * inverse))) {}
};

struct FibreTables {
    const float *lobes; // (A, T, H, 8): N_R, N_TT, N_TRT, N_rest, G_R, G_TT, G_TRT + G_rest, 0
    const float *sums;  // (A, T, 8): a_f, a_b, s, m, twice the circle means of N for TT, TRT + rest, v_f, v_b; see shade.hpp
    const float *pigment; // (K, J, 4): absorption R, G, B [1/radius], variance over `variance`; from root to tip, and by u
    const float *across = nullptr; // (A, T, 32): A_p over its mean at 8 places from the middle to the side; null: the mean shows
    float eta = 1.55f, scale = 0.1f; // refractive index, and of the logistic around the fibre: what `across` is used with
    int A, T, H, K, J;
    float variance[4], absorption_max;
    bool reciprocal = false; // light that is scattered once takes the lobes at theta_d, not at theta_o
    float tilt_cosine[4], tilt_sine[4]; // of the shift of theta_o in each lobe
};

/// M from cos ti cos to and sin ti sin to; I0 by Abramowitz and Stegun 9.8.1 and 9.8.2, scaled so that nothing overflows.
RINGLET_INLINE Floats along(Floats cosines, Floats sines, const Lobe &lobe) {
    const Floats a = cosines * lobe.inverse, root = 1.0f / square_root<float>(maximum<float>(a, splat(3.75f)));
    const Ints large = a > 3.75f;
    const Floats y = a * a * (1 / (3.75f * 3.75f)), z = 3.75f * root * root;
    Floats small_sum = splat(0.0045813f), large_sum = splat(0.00392377f);
    for (float c : {0.0360768f, 0.2659732f, 1.2067492f, 3.0899424f, 3.5156229f, 1.0f}) small_sum = small_sum * y + c;
    for (float c : {-0.01647633f, 0.02635537f, -0.02057706f, 0.00916281f, -0.00157565f, 0.00225319f, 0.01328592f, 0.39894228f})
        large_sum = large_sum * z + c;
    const Floats bessel = large ? large_sum * root : small_sum;
    // I0 = e^a * large_sum: e^a joins the exponent before it can overflow
    const Floats exponent = -(1.0f + sines - (large ? cosines : splat(0.0f))) * lobe.inverse;
    return bessel * exponential(exponent) * lobe.norm;
}

/// A place on one axis of a table: the entry below, and how far the next one is in. Kept as arrays, because it is
/// read lane by lane.
struct Place {
    int at[16];
    float part[16];

    /// x in units of entries, clamped to the axis of `count` entries.
    RINGLET_INLINE Place(Floats x, int count) {
        x = clamp(x, 0, float(count - 1));
        const Ints below = whole(minimum<float>(x, splat(count - 1.5f)));
        const Floats rest = x - real(below);
        __builtin_memcpy(at, &below, sizeof at);
        __builtin_memcpy(part, &rest, sizeof part);
    }
};

/// The record (4 or 8 floats) that starts here.
template <class Record> RINGLET_INLINE Record load(const float *from) {
    Record r;
    __builtin_memcpy(&r, from, sizeof r);
    return r;
}

template <class Record> RINGLET_INLINE Record mean(Record a, Record b, float part) { return a + part * (b - a); }

/// Turns 16 records of n into n entries of 16 lanes: log2(n) times the even elements first, then the odd ones.
template <class Record> RINGLET_INLINE void transpose(const Record records[16], Floats *entries) {
    constexpr int n = sizeof(Record) / 4;
    Floats a[n], b[n];
    __builtin_memcpy(a, records, sizeof a);
    for (int width = n; width > 1; width /= 2) {
        for (int i = 0; i < n / 2; ++i) {
            b[i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            b[i + n / 2] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        }
        __builtin_memcpy(a, b, sizeof a);
    }
    __builtin_memcpy(entries, a, sizeof a);
}

/// Records linear between 8 neighbours, for 16 points; the next entry along each axis is `stride` floats on.
template <class Record>
RINGLET_INLINE void read(const float *table, const Place &x, const Place &y, const Place &z, const size_t stride[3], Floats *entries) {
    Record records[16];
    for (int i = 0; i < 16; ++i) {
        const float *at = table + x.at[i] * stride[0] + y.at[i] * stride[1] + z.at[i] * stride[2];
        const auto edge = [&](const float *from) { return mean(load<Record>(from), load<Record>(from + stride[2]), z.part[i]); };
        const auto side = [&](const float *from) { return mean(edge(from), edge(from + stride[1]), y.part[i]); };
        records[i] = mean(side(at), side(at + stride[0]), x.part[i]);
    }
    transpose(records, entries);
}

/// Entries of `lobes` for 16 points: linear in absorption, theta and phi.
RINGLET_INLINE void read_lobes(const FibreTables &tables, const Place &level, const Place &theta, const Place &phi, Floats entries[8]) {
    const size_t row = 8 * size_t(tables.H), stride[3] = {row * tables.T, row, 8};
    read<Eight>(tables.lobes, level, theta, phi, stride, entries);
}

/// Records of a table (.., `across`, n), linear between 4 neighbours, for 16 points.
template <class Record>
RINGLET_INLINE void read(const float *table, int across, const Place &x, const Place &y, Floats *entries) {
    constexpr int n = sizeof(Record) / 4;
    Record records[16];
    for (int i = 0; i < 16; ++i) {
        const float *at = table + n * (x.at[i] * size_t(across) + y.at[i]);
        const auto edge = [&](const float *from) { return mean(load<Record>(from), load<Record>(from + n), y.part[i]); };
        records[i] = mean(edge(at), edge(at + n * across), x.part[i]);
    }
    transpose(records, entries);
}

/// Entries of `sums` for 16 points: linear in absorption and theta.
RINGLET_INLINE void read_sums(const FibreTables &tables, const Place &level, const Place &theta, Floats entries[8]) {
    read<Eight>(tables.sums, tables.T, level, theta, entries);
}

/// Entries of `pigment` for 16 points: linear along the strand (0 .. 1) and in u (0 .. 1).
RINGLET_INLINE void read_pigment(const FibreTables &tables, Floats along, Floats u, Floats entries[4]) {
    read<Four>(tables.pigment, tables.J, Place(along * float(tables.K - 1), tables.K), Place(u * float(tables.J - 1), tables.J), entries);
}

} // namespace ringlet
