// Elementary functions of 16 floats side by side, and the hash behind everything random in shading.
//
// Polynomials of our own: the C library's vector functions differ between systems.
#pragma once

#include "simd.hpp"

#include <initializer_list>

namespace ringlet {

using Floats = Lanes<float>;
using Ints = Mask<float>;
typedef uint32_t Words __attribute__((vector_size(64)));

RINGLET_INLINE Ints whole(Floats x) { return __builtin_convertvector(x, Ints); }
RINGLET_INLINE Floats real(Ints i) { return __builtin_convertvector(i, Floats); }
RINGLET_INLINE Floats clamp(Floats x, float low, float high) {
    return minimum<float>(maximum<float>(x, splat(low)), splat(high));
}

/// e^x to 2e-7, for x <= 88; 0 below -87.
RINGLET_INLINE Floats exponential(Floats x) {
    const Ints vanishes = x < -87.0f;
    x = maximum<float>(x, splat(-87.0f));
    // x = n ln 2 + r, |r| <= ln 2 / 2; adding 1.5 2^23 rounds to the nearest integer
    const Floats n = (x * 1.44269504f + 12582912.0f) - 12582912.0f;
    const Floats r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
    Floats p = splat(1.9875691500e-4f);
    for (float c : {1.3981999507e-3f, 8.3334519073e-3f, 4.1665795894e-2f, 1.6666665459e-1f, 5.0000001201e-1f}) p = p * r + c;
    p = (p * r) * r + r + 1.0f;
    const Ints power = (whole(n) + 127) << 23;
    Floats two_n;
    __builtin_memcpy(&two_n, &power, sizeof power);
    return vanishes ? splat(0.0f) : p * two_n;
}

/// arccos to 1e-6; the argument is clamped to [-1, 1]. Source: Abramowitz and Stegun, 4.4.46.
RINGLET_INLINE Floats arc_cosine(Floats x) {
    x = clamp(x, -1, 1);
    const Floats a = x < 0.0f ? -x : x;
    Floats p = splat(-0.0012624911f);
    for (float c : {0.0066700901f, -0.0170881256f, 0.0308918810f, -0.0501743046f, 0.0889789874f, -0.2145988016f, 1.5707963050f})
        p = p * a + c;
    const Floats angle = square_root<float>(1.0f - a) * p;
    return x < 0.0f ? 3.14159265f - angle : angle;
}

/// A well-mixed 32-bit hash. Source: Chris Wellons, Prospecting for Hash Functions, 2018 ("lowbias32").
template <class Word> RINGLET_INLINE Word mix(Word x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

/// Uniform in [0, 1).
RINGLET_INLINE Floats uniform(Words hash) { return __builtin_convertvector(hash >> 8, Floats) * 0x1p-24f; }

} // namespace ringlet
