// Rows of memory to lanes and back: what a strand keeps side by side comes to lie in one lane, by shuffles.
//
// Loads and stores of 64 bytes and 64 shuffles move 256 numbers; one number at a time takes three times as long.
#pragma once

#include "simd.hpp"

#include <cstddef>

namespace ringlet {

#ifdef __AVX512F__
/// Rows to columns: of sixteen vectors the i-th of the k-th becomes the k-th of the i-th.
RINGLET_INLINE void transpose(__m512 (&r)[16]) {
    __m512 t[16];
    for (int i = 0; i < 16; i += 2) {
        t[i] = _mm512_maskz_unpacklo_ps(0xffff, r[i], r[i + 1]);
        t[i + 1] = _mm512_maskz_unpackhi_ps(0xffff, r[i], r[i + 1]);
    }
    const auto pairs = [](__m512 a, __m512 b, bool high) RINGLET_ALWAYS {
        const __m512d c = _mm512_castps_pd(a), d = _mm512_castps_pd(b);
        return _mm512_castpd_ps(high ? _mm512_maskz_unpackhi_pd(0xff, c, d) : _mm512_maskz_unpacklo_pd(0xff, c, d));
    };
    for (int i = 0; i < 16; i += 4)
        for (int k = 0; k < 4; ++k) r[i + k] = pairs(t[i + k / 2], t[i + 2 + k / 2], k % 2); // column k of four rows
    for (int k = 0; k < 4; ++k) {
        const __m512 a = _mm512_maskz_shuffle_f32x4(0xffff, r[k], r[4 + k], 0x88);
        const __m512 b = _mm512_maskz_shuffle_f32x4(0xffff, r[k], r[4 + k], 0xdd);
        const __m512 c = _mm512_maskz_shuffle_f32x4(0xffff, r[8 + k], r[12 + k], 0x88);
        const __m512 d = _mm512_maskz_shuffle_f32x4(0xffff, r[8 + k], r[12 + k], 0xdd);
        t[k] = _mm512_maskz_shuffle_f32x4(0xffff, a, c, 0x88), t[8 + k] = _mm512_maskz_shuffle_f32x4(0xffff, a, c, 0xdd);
        t[4 + k] = _mm512_maskz_shuffle_f32x4(0xffff, b, d, 0x88), t[12 + k] = _mm512_maskz_shuffle_f32x4(0xffff, b, d, 0xdd);
    }
    for (int i = 0; i < 16; ++i) r[i] = t[i];
}
#endif

/// to[i][lane] = source[row[lane] * count + i], i < count.
inline void read_rows(Lanes<float> *to, const float *source, int count, const int (&row)[kLanes<float>]) {
    int i = 0;
#ifdef __AVX512F__
    for (; i + 16 <= count; i += 16) {
        __m512 r[16];
        for (int lane = 0; lane < 16; ++lane) r[lane] = _mm512_loadu_ps(source + size_t(row[lane]) * count + i);
        transpose(r);
        for (int k = 0; k < 16; ++k) to[i + k] = Lanes<float>(r[k]);
    }
#endif
    for (int lane = 0; lane < kLanes<float>; ++lane)
        for (int k = i; k < count; ++k) to[k][lane] = source[size_t(row[lane]) * count + k];
}

/// target[row[lane] * count + i] = from[i][lane], i < count, lane < rows.
inline void write_rows(const Lanes<float> *from, float *target, int count, const int (&row)[kLanes<float>], int rows) {
    int i = 0;
#ifdef __AVX512F__
    for (; i + 16 <= count; i += 16) {
        __m512 r[16];
        for (int k = 0; k < 16; ++k) r[k] = __m512(from[i + k]);
        transpose(r);
        for (int lane = 0; lane < rows; ++lane) _mm512_storeu_ps(target + size_t(row[lane]) * count + i, r[lane]);
    }
#endif
    for (int lane = 0; lane < rows; ++lane)
        for (int k = i; k < count; ++k) target[size_t(row[lane]) * count + k] = from[k][lane];
}

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
