// Blocks of strands side by side: one SIMD lane holds one strand.
//
// A `Lanes<Real>` is 64 bytes wide on every instruction set (8 x float64 or 16 x float32; narrower
// machines split it), so that a block holds the same strands everywhere. `Vec3<Real>` is a point of
// each strand of the block.
#pragma once

#include <cmath>
#include <cstdint>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace ringlet {

template <class Real> struct LaneTypes;
template <> struct LaneTypes<double> {
    typedef double Lanes __attribute__((vector_size(64)));
    typedef int64_t Mask __attribute__((vector_size(64)));
};
template <> struct LaneTypes<float> {
    typedef float Lanes __attribute__((vector_size(64)));
    typedef int32_t Mask __attribute__((vector_size(64)));
};

template <class Real> using Lanes = typename LaneTypes<Real>::Lanes;
template <class Real> using Mask = typename LaneTypes<Real>::Mask;

/// Strands in a block.
template <class Real> inline constexpr int kLanes = 64 / int(sizeof(Real));

#define RINGLET_ALWAYS __attribute__((always_inline)) // for lambdas
#define RINGLET_INLINE inline RINGLET_ALWAYS

template <class Real> RINGLET_INLINE Lanes<Real> splat(Real value) { return Lanes<Real>{} + value; }

template <class Real> RINGLET_INLINE Lanes<Real> square_root(Lanes<Real> a) {
    Lanes<Real> r;
    for (int i = 0; i < kLanes<Real>; ++i) r[i] = std::sqrt(a[i]);
    return r;
}

/// 1 / a of a finite a that is not 0, to the last bit or two. Its 14-bit estimate costs a tenth of a division.
template <class Real> RINGLET_INLINE Lanes<Real> reciprocal(Lanes<Real> a) {
#ifdef __AVX512F__
    Lanes<Real> y;
    if constexpr (sizeof(Real) == 4) {
        y = Lanes<Real>(_mm512_maskz_rcp14_ps(0xffff, __m512(a)));
    } else {
        y = Lanes<Real>(_mm512_maskz_rcp14_pd(0xff, __m512d(a)));
        y += y * (1 - a * y);
    }
    return y + y * (1 - a * y);
#else
    return 1 / a;
#endif
}

/// 1 / sqrt(a) of a finite a > 0, to the last bit or two.
template <class Real> RINGLET_INLINE Lanes<Real> inverse_root(Lanes<Real> a) {
#ifdef __AVX512F__
    Lanes<Real> y;
    if constexpr (sizeof(Real) == 4) {
        y = Lanes<Real>(_mm512_maskz_rsqrt14_ps(0xffff, __m512(a)));
    } else {
        y = Lanes<Real>(_mm512_maskz_rsqrt14_pd(0xff, __m512d(a)));
        y += (Real(0.5) * y) * (1 - (a * y) * y);
    }
    return y + (Real(0.5) * y) * (1 - (a * y) * y);
#else
    return 1 / square_root<Real>(a);
#endif
}

template <class Real> RINGLET_INLINE Lanes<Real> select(Mask<Real> mask, Lanes<Real> yes, Lanes<Real> no) {
    return mask ? yes : no;
}

template <class Real> RINGLET_INLINE Real largest(Lanes<Real> a) {
    Real m = a[0];
    for (int i = 1; i < kLanes<Real>; ++i) m = a[i] > m ? a[i] : m;
    return m;
}

template <class Real> RINGLET_INLINE Real smallest(Lanes<Real> a) {
    Real m = a[0];
    for (int i = 1; i < kLanes<Real>; ++i) m = a[i] < m ? a[i] : m;
    return m;
}

/// a > b ? a : b, as one instruction: where b is a constant, the compiler makes two of it.
template <class Real> RINGLET_INLINE Lanes<Real> maximum(Lanes<Real> a, Lanes<Real> b) {
#ifdef __AVX512F__
    if constexpr (sizeof(Real) == 4) return Lanes<Real>(_mm512_maskz_max_ps(0xffff, __m512(a), __m512(b)));
    else return Lanes<Real>(_mm512_maskz_max_pd(0xff, __m512d(a), __m512d(b)));
#else
    return a > b ? a : b;
#endif
}

/// a < b ? a : b, as one instruction.
template <class Real> RINGLET_INLINE Lanes<Real> minimum(Lanes<Real> a, Lanes<Real> b) {
#ifdef __AVX512F__
    if constexpr (sizeof(Real) == 4) return Lanes<Real>(_mm512_maskz_min_ps(0xffff, __m512(a), __m512(b)));
    else return Lanes<Real>(_mm512_maskz_min_pd(0xff, __m512d(a), __m512d(b)));
#else
    return a < b ? a : b;
#endif
}

/// Without its sign.
RINGLET_INLINE Lanes<float> magnitude(Lanes<float> a) { return Lanes<float>(Mask<float>(a) & 0x7fffffff); }

/// x rounded to the nearest integer: adding 1.5 2^52 (2^23) leaves no digits after the point.
template <class Real> RINGLET_INLINE Lanes<Real> nearest(Lanes<Real> x) {
    constexpr Real shift = sizeof(Real) == 4 ? Real(12582912.0) : Real(6755399441055744.0);
    return (x + shift) - shift;
}

/// A bit for each lane that is set.
template <class Real> RINGLET_INLINE uint32_t set_lanes(Mask<Real> mask) {
#ifdef __AVX512F__
    if constexpr (sizeof(Real) == 4) return uint32_t(_mm512_cmplt_epi32_mask(__m512i(mask), _mm512_setzero_si512()));
    else return uint32_t(_mm512_cmplt_epi64_mask(__m512i(mask), _mm512_setzero_si512()));
#else
    uint32_t bits = 0;
    for (int i = 0; i < kLanes<Real>; ++i) bits |= uint32_t(mask[i] != 0) << i;
    return bits;
#endif
}

/// Whether any lane of the mask is set.
template <class Real> RINGLET_INLINE bool any(Mask<Real> mask) {
#ifdef __AVX512F__
    return set_lanes<Real>(mask) != 0;
#else
    int64_t words[8], bits = 0;
    __builtin_memcpy(words, &mask, sizeof words);
    for (int64_t word : words) bits |= word;
    return bits != 0;
#endif
}

/// Writes the lanes of a that are set, one after the other, and how many there are comes back. All of
/// to[0 .. kLanes - 1] may be written to.
RINGLET_INLINE int write_chosen(Mask<float> mask, Mask<float> a, int32_t *to) {
    const uint32_t bits = set_lanes<float>(mask);
#ifdef __AVX512F__
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(__mmask16(bits), __m512i(a)));
#else
    for (uint32_t left = bits; left; left &= left - 1) *to++ = a[__builtin_ctz(left)];
#endif
    return __builtin_popcount(bits);
}

/// Writes the numbers of the lanes that are set, counted from `first`, one after the other, and how many there are
/// comes back. All of to[0 .. kLanes - 1] may be written to.
RINGLET_INLINE int write_set_lanes(Mask<float> mask, int first, int *to) {
#ifdef __AVX512F__
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i numbers = _mm512_add_epi32(lanes, _mm512_set1_epi32(first));
    const uint32_t bits = set_lanes<float>(mask);
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(__mmask16(bits), numbers));
    return __builtin_popcount(bits);
#else
    int count = 0;
    for (uint32_t bits = set_lanes<float>(mask); bits; bits &= bits - 1) to[count++] = first + __builtin_ctz(bits);
    return count;
#endif
}

/// Writes the values of the lanes that are set one after the other, and how many there are comes back. All of
/// to[0 .. 15] may be written to.
RINGLET_INLINE int pack_set_lanes(Mask<float> mask, Lanes<float> values, float *to) {
#ifdef __AVX512F__
    const uint32_t bits = set_lanes<float>(mask);
    _mm512_storeu_ps(to, _mm512_maskz_compress_ps(__mmask16(bits), __m512(values)));
    return __builtin_popcount(bits);
#else
    int count = 0;
    for (uint32_t bits = set_lanes<float>(mask); bits; bits &= bits - 1) to[count++] = values[__builtin_ctz(bits)];
    return count;
#endif
}

/// Writes high << 32 | low of the lanes that are set, one after the other, and how many there are comes back. All of
/// to[0 .. kLanes - 1] may be written to.
RINGLET_INLINE int write_chosen_pairs(Mask<float> mask, Mask<float> low, Mask<float> high, uint64_t *to) {
    const uint32_t bits = set_lanes<float>(mask);
#ifdef __AVX512F__
    const __m512i chosen_low = _mm512_maskz_compress_epi32(__mmask16(bits), __m512i(low));
    const __m512i chosen_high = _mm512_maskz_compress_epi32(__mmask16(bits), __m512i(high));
    const __m512i first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const __m512i second = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    _mm512_storeu_si512(to, _mm512_permutex2var_epi32(chosen_low, first, chosen_high));
    _mm512_storeu_si512(to + 8, _mm512_permutex2var_epi32(chosen_low, second, chosen_high));
#else
    for (uint32_t left = bits; left; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        *to++ = uint64_t(uint32_t(high[lane])) << 32 | uint32_t(low[lane]);
    }
#endif
    return __builtin_popcount(bits);
}

/// Reads values[at] and values[at + 1] of every lane.
template <class Real>
RINGLET_INLINE void gather_pairs(const float *values, Mask<Real> at, Lanes<Real> &first, Lanes<Real> &second) {
#ifdef __AVX512F__
    if constexpr (sizeof(Real) == 4) {
        const __m512i even = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
        __m256i half[2];
        __builtin_memcpy(half, &at, sizeof at);
        const __m512d none = _mm512_setzero_pd();
        const __m512 low = _mm512_castpd_ps(_mm512_mask_i32gather_pd(none, 0xff, half[0], values, 4));
        const __m512 high = _mm512_castpd_ps(_mm512_mask_i32gather_pd(none, 0xff, half[1], values, 4));
        first = Lanes<Real>(_mm512_permutex2var_ps(low, even, high));
        second = Lanes<Real>(_mm512_permutex2var_ps(low, _mm512_add_epi32(even, _mm512_set1_epi32(1)), high));
    } else {
        const __m512d none = _mm512_setzero_pd();
        const __m512i pairs = _mm512_castpd_si512(_mm512_mask_i64gather_pd(none, 0xff, __m512i(at), values, 4));
        const __m256i odd = _mm512_maskz_cvtepi64_epi32(0xff, _mm512_maskz_srli_epi64(0xff, pairs, 32));
        first = Lanes<Real>(_mm512_maskz_cvtps_pd(0xff, _mm256_castsi256_ps(_mm512_maskz_cvtepi64_epi32(0xff, pairs))));
        second = Lanes<Real>(_mm512_maskz_cvtps_pd(0xff, _mm256_castsi256_ps(odd)));
    }
#else
    for (int k = 0; k < kLanes<Real>; ++k) first[k] = Real(values[at[k]]), second[k] = Real(values[at[k] + 1]);
#endif
}

/// values[at] of every lane.
RINGLET_INLINE Lanes<float> gather_floats(const float *values, Mask<float> at) {
#ifdef __AVX512F__
    return Lanes<float>(_mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, __m512i(at), values, 4));
#else
    Lanes<float> result;
    for (int lane = 0; lane < kLanes<float>; ++lane) result[lane] = values[at[lane]];
    return result;
#endif
}

/// Lane at[k] of the values, 0 <= at < 16, in every lane k.
RINGLET_INLINE Lanes<float> pick(Lanes<float> values, Mask<float> at) {
#ifdef __AVX512F__
    return Lanes<float>(_mm512_maskz_permutexvar_ps(0xffff, __m512i(at), __m512(values)));
#else
    Lanes<float> result;
    for (int lane = 0; lane < kLanes<float>; ++lane) result[lane] = values[at[lane]];
    return result;
#endif
}

/// values[at] of every lane; three more bytes behind the last value may be read.
RINGLET_INLINE Mask<float> gather_bytes(const int8_t *values, Mask<float> at) {
#ifdef __AVX512F__
    const __m512i four = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, __m512i(at), values, 1);
    return Mask<float>(four) << 24 >> 24;
#else
    Mask<float> result;
    for (int lane = 0; lane < kLanes<float>; ++lane) result[lane] = values[at[lane]];
    return result;
#endif
}

template <class Real> struct Vec3 {
    Lanes<Real> x, y, z;

    friend RINGLET_INLINE Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend RINGLET_INLINE Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend RINGLET_INLINE Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
    friend RINGLET_INLINE Vec3 select(Mask<Real> mask, Vec3 yes, Vec3 no) {
        return {mask ? yes.x : no.x, mask ? yes.y : no.y, mask ? yes.z : no.z};
    }
    friend RINGLET_INLINE Vec3 operator*(Lanes<Real> s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
    friend RINGLET_INLINE Lanes<Real> dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend RINGLET_INLINE Vec3 cross(Vec3 a, Vec3 b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
};

template <class Real> Vec3<Real> broadcast(const double *a) {
    return {splat(Real(a[0])), splat(Real(a[1])), splat(Real(a[2]))};
}

} // namespace ringlet
