// From samples in the framebuffer to pixels: decode, average in linear light, encode.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

/// What bytes mean: linear value of each byte of a sample, and the byte of each step of scaled linear values.
struct ToneCurve {
    const float *decode; // (256,)
    const uint8_t *encode;
    int steps;
    float scale; // steps of `encode` for a linear 1
};

/// Fills pixels (H, W, 3) from samples (H n, W n, 3): the mean over n x n of each channel.
inline void develop(const uint8_t *samples, uint8_t *pixels, size_t H, size_t W, int n, const ToneCurve &tone, int threads) {
    const size_t row = 3 * W * n;
    const float scale = tone.scale / float(n * n), last = float(tone.steps - 1);
#pragma omp parallel num_threads(threads)
    {
        std::vector<float> sums(3 * W);
#pragma omp for schedule(static)
        for (size_t y = 0; y < H; ++y) {
            std::fill(sums.begin(), sums.end(), 0.0f);
            for (int j = 0; j < n; ++j) {
                const uint8_t *at = samples + (y * n + j) * row;
                for (size_t x = 0; x < W; ++x)
                    for (int i = 0; i < n; ++i, at += 3)
                        for (int c = 0; c < 3; ++c) sums[3 * x + c] += tone.decode[at[c]];
            }
            for (size_t k = 0; k < 3 * W; ++k)
                pixels[3 * y * W + k] = tone.encode[int(std::max(0.0f, std::min(last, sums[k] * scale)))];
        }
    }
}

} // namespace ringlet
