// Rows of memory to lanes and back, with another type on the way: what a strand keeps side by side comes to lie in one
// lane. Whole rows are loaded and transposed by shuffles, log2 n rounds of them: a number at a time takes ten times as long.
#pragma once

#include "simd.hpp"

#include <utility>

namespace ringlet {

/// kLanes<Real> numbers of memory.
template <class Real, class Source> struct RowOf {
    typedef Source Type __attribute__((vector_size(sizeof(Source) * kLanes<Real>)));
};

template <class Real, class Source> RINGLET_INLINE Lanes<Real> load_row(const Source *from) {
    typename RowOf<Real, Source>::Type row;
    __builtin_memcpy(&row, from, sizeof row);
    return __builtin_convertvector(row, Lanes<Real>);
}

template <class Real, class Target> RINGLET_INLINE void store_row(Lanes<Real> numbers, Target *to) {
    const auto row = __builtin_convertvector(numbers, typename RowOf<Real, Target>::Type);
    __builtin_memcpy(to, &row, sizeof row);
}

/// Exchanges what lies `Half` apart, rows with lanes, and then does so for all smaller distances.
template <class Real, int Half, int... Lane>
RINGLET_INLINE void exchange_halves(Lanes<Real> *rows, std::integer_sequence<int, Lane...> lanes) {
    constexpr int n = kLanes<Real>;
    const Mask<Real> low = {(Lane & Half ? n + Lane - Half : Lane)...}, high = {(Lane & Half ? n + Lane : Lane + Half)...};
#pragma GCC unroll 16
    for (int i = 0; i < n; ++i) {
        if (i & Half) continue;
        const Lanes<Real> a = rows[i], b = rows[i + Half];
        rows[i] = __builtin_shuffle(a, b, low), rows[i + Half] = __builtin_shuffle(a, b, high);
    }
    if constexpr (Half > 1) exchange_halves<Real, Half / 2>(rows, lanes);
}

/// Rows to columns: number k of row i becomes number i of row k.
template <class Real> RINGLET_INLINE void transpose(Lanes<Real> (&rows)[kLanes<Real>]) {
    exchange_halves<Real, kLanes<Real> / 2>(rows, std::make_integer_sequence<int, kLanes<Real>>());
}

} // namespace ringlet
