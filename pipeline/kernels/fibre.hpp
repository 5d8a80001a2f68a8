// One hair fibre seen from afar: S = sum over the lobes R, TT, TRT and rest of M_p (along) N_p (around).
//
// M_p(theta_i, theta_o) = exp(-sin ti sin to / v) I0(cos ti cos to / v) / (2 v sinh(1/v)): d'Eon et al., An
// Energy-Conserving Hair Reflectance Model, EGSR 2011. N_p and its sums come from tables (pipeline/render/fibre.py).
#pragma once

#include "elementary.hpp"

#include <cstddef>

namespace ringlet {

typedef float Eight __attribute__((vector_size(32)));

/// One lobe's variance v, as M needs it.
struct Lobe {
    Floats inverse, norm; // 1 / v and 1 / (v (1 - e^(-2/v)))

    RINGLET_INLINE Lobe(float inverse, float norm) : inverse(splat(inverse)), norm(splat(norm)) {}
    RINGLET_INLINE explicit Lobe(Floats v) : inverse(1.0f / v), norm(inverse / (1.0f - exponential(-2.0f * inverse))) {}
};

struct FibreTables {
    const float *lobes; // (A, T, H, 8): N_R, N_TT, N_TRT, N_rest, G_R, G_TT, G_TRT + G_rest, 0
    const float *sums;  // (A, T, 8): a_f, a_b, circle means of N for R, TT, TRT + rest, v_f, v_b, 0
    int A, T, H;
    float variance[4], absorption_max;
    float inverse[4], norm[4];          // of each variance, see Lobe
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

/// A place on one axis of a table: the entry below, and how far the next one is in.
struct Place {
    Ints at;
    Floats part;

    /// x in units of entries, clamped to the axis of `count` entries.
    RINGLET_INLINE Place(Floats x, int count) {
        x = clamp(x, 0, float(count - 1));
        at = whole(minimum<float>(x, splat(count - 1.5f)));
        part = x - real(at);
    }
};

RINGLET_INLINE Eight record(const float *table, size_t index) {
    Eight r;
    __builtin_memcpy(&r, table + 8 * index, sizeof r);
    return r;
}

RINGLET_INLINE Eight mean(Eight a, Eight b, float part) { return a + part * (b - a); }

/// Turns 16 records of 8 into 8 entries of 16 lanes: three times the even elements first, then the odd ones.
RINGLET_INLINE void transpose(const Eight records[16], Floats entries[8]) {
    Floats a[8], b[8];
    __builtin_memcpy(a, records, sizeof a);
    for (int round = 0; round < 3; ++round) {
        for (int i = 0; i < 4; ++i) {
            b[i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            b[i + 4] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        }
        __builtin_memcpy(a, b, sizeof a);
    }
    __builtin_memcpy(entries, a, sizeof a);
}

/// Entries of `lobes` for 16 points: linear in absorption, theta_d and phi.
RINGLET_INLINE void read_lobes(const FibreTables &tables, Place level, Place theta, Place phi, Floats entries[8]) {
    const size_t row = tables.H, sheet = row * tables.T;
    Eight records[16];
    for (int i = 0; i < 16; ++i) {
        const size_t at = level.at[i] * sheet + theta.at[i] * row + phi.at[i];
        const float h = phi.part[i], t = theta.part[i];
        const auto read = [&](size_t from) { return mean(record(tables.lobes, from), record(tables.lobes, from + 1), h); };
        const Eight below = mean(read(at), read(at + row), t), above = mean(read(at + sheet), read(at + sheet + row), t);
        records[i] = mean(below, above, level.part[i]);
    }
    transpose(records, entries);
}

/// Entries of `sums` for 16 points: linear in absorption and theta_d.
RINGLET_INLINE void read_sums(const FibreTables &tables, Place level, Place theta, Floats entries[8]) {
    Eight records[16];
    for (int i = 0; i < 16; ++i) {
        const size_t at = level.at[i] * size_t(tables.T) + theta.at[i];
        const auto read = [&](size_t from) {
            return mean(record(tables.sums, from), record(tables.sums, from + 1), theta.part[i]);
        };
        records[i] = mean(read(at), read(at + tables.T), level.part[i]);
    }
    transpose(records, entries);
}

} // namespace ringlet
