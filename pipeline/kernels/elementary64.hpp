// Logarithm, sine and cosine of 8 doubles side by side, to the last bit or two.
//
// Polynomials of our own: the C library's vector functions differ between systems. Source of the coefficients: FreeBSD
// msun (Sun Microsystems 1993), e_log.c, k_sin.c and k_cos.c.
#pragma once

#include "simd.hpp"

#include <cstdint>
#include <initializer_list>

namespace ringlet {

using Doubles8 = Lanes<double>;
typedef uint64_t LongWords __attribute__((vector_size(64)));

/// Horner: the coefficients from the highest power of z down.
RINGLET_INLINE Doubles8 polynomial(Doubles8 z, std::initializer_list<double> coefficients) {
    Doubles8 p{};
    for (double c : coefficients) p = p * z + c;
    return p;
}

/// ln x of a positive x that is not subnormal.
RINGLET_INLINE Doubles8 logarithm(Doubles8 x) {
    // x = 2^k m with m from 1/sqrt(2) to sqrt(2)
    LongWords bits;
    __builtin_memcpy(&bits, &x, sizeof x);
    bits += 0x3ff0000000000000ull - 0x3fe6a09e667f3bcdull;
    const Doubles8 k = __builtin_convertvector(Mask<double>(bits >> 52) - 1023, Doubles8);
    bits = (bits & 0x000fffffffffffffull) + 0x3fe6a09e667f3bcdull;
    Doubles8 m;
    __builtin_memcpy(&m, &bits, sizeof m);
    const Doubles8 f = m - 1, s = f / (2 + f), z = s * s, half = 0.5 * f * f;
    const Doubles8 R = z * polynomial(z, {1.479819860511658591e-01, 1.531383769920937332e-01, 1.818357216161805012e-01,
                                          2.222219843214978396e-01, 2.857142874366239149e-01, 3.999999999940941908e-01,
                                          6.666666666666735130e-01});
    return k * 6.93147180369123816490e-01 - ((half - (s * (half + R) + k * 1.90821492927058770002e-10)) - f);
}

struct SineCosine {
    Doubles8 sine, cosine;
};

/// Sine and cosine of an angle in turns (1 is 2 pi), below 2^50 of them.
RINGLET_INLINE SineCosine of_turns(Doubles8 turns) {
    // The nearest quarter turn, and what is left, at most an eighth; adding 1.5 2^52 rounds to the nearest integer
    const double kRound = 6755399441055744.0;
    const Doubles8 quarter = (4 * turns + kRound) - kRound;
    const Doubles8 x = 6.283185307179586477 * (turns - 0.25 * quarter), z = x * x;
    const Doubles8 s = x + x * z * polynomial(z, {1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06,
                                                  -1.98412698298579493134e-04, 8.33333333332248946124e-03, -1.66666666666666324348e-01});
    const Doubles8 c = 1 - 0.5 * z + z * z * polynomial(z, {-1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07,
                                                           2.48015872894767294178e-05, -1.38888888888741095749e-03, 4.16666666666666019037e-02});
    const Mask<double> n = __builtin_convertvector(quarter, Mask<double>);
    const Mask<double> odd = (n & 1) != 0;
    const Doubles8 sine = odd ? c : s, cosine = odd ? s : c;
    return {(n & 2) != 0 ? -sine : sine, ((n + 1) & 2) != 0 ? -cosine : cosine};
}

} // namespace ringlet
