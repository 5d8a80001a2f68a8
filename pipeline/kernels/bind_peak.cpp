// The peak of one processor core, for comparison with what a kernel reaches.
#include "bindings.hpp"

#include "simd.hpp"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <chrono>
#include <string>

namespace ringlet {

/// Operations a second of independent fused multiply-adds in registers, each of which counts two.
template <class Real> static double peak() {
    constexpr int chains = 16, rounds = 200000; // enough to hide a latency of 4 on two units
    Lanes<Real> sum[chains], factor = splat(Real(0.5)), term = splat(Real(1));
#pragma GCC unroll 16
    for (int k = 0; k < chains; ++k) sum[k] = splat(Real(k));
    const auto start = std::chrono::steady_clock::now();
    for (int round = 0; round < rounds; ++round) {
        asm volatile("" : "+m"(factor)); // so that the loop is not thought away
        const Lanes<Real> by = factor;
#pragma GCC unroll 16
        for (int k = 0; k < chains; ++k) sum[k] = sum[k] * by + term;
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
#pragma GCC unroll 16
    for (int k = 1; k < chains; ++k) sum[0] += sum[k];
    volatile Real keep = sum[0][0];
    (void)keep;
    return 2.0 * chains * kLanes<Real> * rounds / elapsed.count();
}

static double peak_flops(const std::string &precision) {
    require(precision == "float32" || precision == "float64", "peak_flops: expected \"float32\" or \"float64\"");
    double best = 0;
    for (int repeat = 0; repeat < 5; ++repeat)
        best = std::max(best, precision == "float32" ? peak<float>() : peak<double>());
    return best;
}

void bind_peak(nb::module_ &m) {
    m.def("peak_flops", &peak_flops, nb::arg("precision"));
}

} // namespace ringlet
