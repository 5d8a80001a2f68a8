// Four numbers side by side of every lane, between one row of memory and the next: loads of 16 bytes and shuffles.
#pragma once

#include "simd.hpp"

namespace ringlet {

/// Four numbers side by side, of every lane.
struct Four {
    Lanes<float> part[4];
};

/// part[k] of a lane: number k of the four from source + 4 at, by f of the way to the four after them.
RINGLET_INLINE Four read_between(const float *source, Mask<float> at, Lanes<float> f) {
    uint32_t first[kLanes<float>];
    at *= 4;
    __builtin_memcpy(first, &at, sizeof first);
#ifdef __AVX512F__
    asm("" : "+m"(first)); // through memory: taking numbers out of a register one by one costs more than all the rest
    __m512 r[4];
    for (int i = 0; i < 4; ++i) { // the fours of lanes i, i+4, i+8, i+12
        const auto fours = [&](const float *from) RINGLET_ALWAYS {
            __m512 a = _mm512_castps128_ps512(_mm_loadu_ps(from + first[i]));
            a = _mm512_mask_broadcast_f32x4(a, 0x00f0, _mm_loadu_ps(from + first[i + 4]));
            a = _mm512_mask_broadcast_f32x4(a, 0x0f00, _mm_loadu_ps(from + first[i + 8]));
            return _mm512_mask_broadcast_f32x4(a, 0xf000, _mm_loadu_ps(from + first[i + 12]));
        };
        r[i] = fours(source);
        const Lanes<float> here = Lanes<float>(r[i]), next = Lanes<float>(fours(source + 4));
        const __m512i lane = _mm512_add_epi32(_mm512_setr_epi32(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12),
                                              _mm512_set1_epi32(i));
        r[i] = __m512(here + Lanes<float>(_mm512_maskz_permutexvar_ps(0xffff, lane, __m512(f))) * (next - here));
    }
    const __m512d a = _mm512_castps_pd(_mm512_maskz_unpacklo_ps(0xffff, r[0], r[1])),
                  b = _mm512_castps_pd(_mm512_maskz_unpackhi_ps(0xffff, r[0], r[1])),
                  c = _mm512_castps_pd(_mm512_maskz_unpacklo_ps(0xffff, r[2], r[3])),
                  d = _mm512_castps_pd(_mm512_maskz_unpackhi_ps(0xffff, r[2], r[3]));
    const auto low = [](__m512d p, __m512d q) RINGLET_ALWAYS { return Lanes<float>(_mm512_maskz_unpacklo_pd(0xff, p, q)); };
    const auto high = [](__m512d p, __m512d q) RINGLET_ALWAYS { return Lanes<float>(_mm512_maskz_unpackhi_pd(0xff, p, q)); };
    return {{low(a, c), high(a, c), low(b, d), high(b, d)}};
#else
    Four result;
    for (int lane = 0; lane < kLanes<float>; ++lane) {
        const float *from = source + first[lane];
        for (int k = 0; k < 4; ++k) result.part[k][lane] = from[k] + f[lane] * (from[k + 4] - from[k]);
    }
    return result;
#endif
}

} // namespace ringlet
