// From samples in the framebuffer to linear pixels, and from linear pixels to those of a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ringlet {

/// Fills linear pixels (H, W, 3) from encoded samples (H n, W n, 3): the mean over n x n of what `decode` (256,) says.
inline void average(const uint8_t *samples, float *pixels, size_t H, size_t W, int n, const float *decode, int threads) {
    const size_t row = 3 * W * n;
    const float share = 1.0f / float(n * n);
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t y = 0; y < H; ++y) {
        float *sums = pixels + 3 * W * y;
        std::fill(sums, sums + 3 * W, 0.0f);
        for (int j = 0; j < n; ++j) {
            const uint8_t *at = samples + (y * n + j) * row;
            for (size_t x = 0; x < W; ++x)
                for (int i = 0; i < n; ++i, at += 3)
                    for (int c = 0; c < 3; ++c) sums[3 * x + c] += decode[at[c]];
        }
        for (size_t k = 0; k < 3 * W; ++k) sums[k] *= share;
    }
}

/// Turns a picture of H rows of so many values upside down, in place.
template <class Value> void turn_over(Value *values, size_t H, size_t row, int threads) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t y = 0; y < H / 2; ++y) std::swap_ranges(values + y * row, values + (y + 1) * row, values + (H - 1 - y) * row);
}

/// What stands for linear values: the code of each step of scaled ones, a byte or 16 bits.
template <class Code> struct ToneCurve {
    const Code *encode;
    int steps;
    float scale; // steps for a linear 1
};

/// Fills codes from `count` linear values.
template <class Code>
void develop(const float *linear, Code *codes, size_t count, const ToneCurve<Code> &tone, int threads) {
    const float last = float(tone.steps - 1);
    constexpr size_t most = 64; // at once: first the steps, side by side
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t first = 0; first < count; first += most) {
        const size_t n = std::min(most, count - first);
        int step[most];
        for (size_t k = 0; k < n; ++k) step[k] = int(std::max(0.0f, std::min(last, linear[first + k] * tone.scale)));
        for (size_t k = 0; k < n; ++k) codes[first + k] = tone.encode[step[k]];
    }
}

} // namespace ringlet
