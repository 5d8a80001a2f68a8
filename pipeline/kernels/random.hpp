// Random numbers as a hash of an index and a word (of seed and salt), 8 side by side.
//
// The hash is the 32-bit finaliser `mix`; a normal number takes two uniform ones (Box and Muller, "A Note on the
// Generation of Random Normal Deviates", 1958).
#pragma once

#include "elementary.hpp"
#include "elementary64.hpp"

#include <cstddef>
#include <cstdint>

namespace ringlet {

typedef uint32_t Indices8 __attribute__((vector_size(32)));

RINGLET_INLINE Indices8 hashed(Indices8 index, uint32_t word) { return mix(index * 0x9E3779B1u + word); }

/// Uniform in [0, 1), a multiple of 2^-32.
RINGLET_INLINE Doubles8 uniform64(Indices8 hash) { return __builtin_convertvector(hash, Doubles8) * 0x1p-32; }

/// Standard normal numbers of two hashes.
RINGLET_INLINE Doubles8 standard_normal(Indices8 length, Indices8 angle) {
    return square_root<double>(-2 * logarithm(1 - uniform64(length))) * of_turns(uniform64(angle)).cosine;
}

/// Calls to(begin, numbers of 8 indices, how many of them there are) for all N indices.
template <class To> void for_indices(const uint32_t *index, size_t N, const To &to) {
    for (size_t begin = 0; begin < N; begin += 8) {
        const size_t count = N - begin < 8 ? N - begin : 8;
        Indices8 of{};
        __builtin_memcpy(&of, index + begin, count * sizeof *index);
        to(begin, of, count);
    }
}

} // namespace ringlet
