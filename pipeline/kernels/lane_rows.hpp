// Tables of lanes that every lane reads at a row of its own.
#pragma once

#include "simd.hpp"

namespace ringlet {

/// rows[at[lane]][lane] of every lane; a row is `Stride` lanes wide.
template <int Stride> RINGLET_INLINE Lanes<double> pick(const Lanes<double> *rows, Mask<double> at) {
#ifdef __AVX512F__
    const __m512i lanes = _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 6, 7);
    const __m512i from = _mm512_add_epi64(__m512i(at * (Stride * 8)), lanes);
    return Lanes<double>(_mm512_mask_i64gather_pd(_mm512_setzero_pd(), 0xff, from, rows, 8));
#else
    Lanes<double> picked;
    for (int lane = 0; lane < kLanes<double>; ++lane) picked[lane] = rows[at[lane] * Stride][lane];
    return picked;
#endif
}

template <int Stride = 1> RINGLET_INLINE Vec3<double> pick(const Vec3<double> *rows, Mask<double> at) {
    return {pick<3 * Stride>(&rows->x, at), pick<3 * Stride>(&rows->y, at), pick<3 * Stride>(&rows->z, at)};
}

} // namespace ringlet
