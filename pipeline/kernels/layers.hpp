// How deep hair is seen: for each tile, the depth behind which enough layers of hair cover everything.
//
// Strands of a subset add their area on the screen to a histogram of depth in each quarter of a tile; where the sum passes
// K times the quarter's area, e^-K of what lies behind would be seen. The tile is cut off where the last of its quarters
// is: one count for all of it would take locks beside a parting for a cover. Counts are integers: they depend on no order.
#pragma once

#include "screen.hpp"

namespace ringlet {

struct Layers {
    static constexpr int kDepths = 128;   // steps of distance between the clipping planes
    static constexpr int kEvery = 8;      // strands of which one is counted
    static constexpr float kUnit = 64;    // counts per square pixel
    static constexpr int kCell = 8;       // [px] side of the part of a tile that is counted by itself
    static constexpr int kParts = (kTile / kCell) * (kTile / kCell);
    static constexpr int kSamples = 3;    // along a segment

    std::vector<std::vector<uint32_t>> counts; // for each thread (tiles, kParts, kDepths); empty: nothing is counted yet

    /// Forgets all counts, but keeps the memory.
    void clear() {
        for (auto &mine : counts) mine.clear();
    }

    /// Adds those of strands (S, P) whose number, from `first` on, is divisible by kEvery.
    void add(const View &view, const float *points, const float *widths, int S, int P, size_t first, int threads) {
        if (int(counts.size()) < threads) counts.resize(threads);
        const int begin = int((kEvery - first % kEvery) % kEvery);
#pragma omp parallel num_threads(threads)
        {
            ScreenStrand strand(P);
#pragma omp for schedule(static, 1)
            for (int thread = 0; thread < threads; ++thread) {
                std::vector<uint32_t> &mine = counts[thread];
                mine.resize(size_t(view.tiles()) * kParts * kDepths);
                for (int s = begin + kEvery * thread; s < S; s += kEvery * threads) {
                    const size_t at = size_t(s) * P;
                    if (!strand.project(view, points + 3 * at, widths + at, P)) continue;
                    for (int j = 0; j + 1 < P; ++j) add_segment(view, strand, j, mine.data());
                }
            }
        }
    }

    /// Depth (tiles,) behind which `layers` of hair are passed everywhere; 2 where there are fewer.
    std::vector<float> depths(const View &view, float layers, int threads) const {
        std::vector<float> depth(view.tiles());
        const uint64_t limit = uint64_t(layers * kCell * kCell * kUnit / kEvery);
#pragma omp parallel for schedule(static) num_threads(threads)
        for (int tile = 0; tile < view.tiles(); ++tile) {
            float most = 0;
            for (int part = 0; part < kParts && most < 2; ++part)
                most = std::max(most, passed(view, size_t(tile) * kParts + part, limit));
            depth[tile] = most;
        }
        return depth;
    }

  private:
    /// Depth behind which so much is counted in a part of a tile.
    float passed(const View &view, size_t part, uint64_t limit) const {
        const float step = (view.far - view.near) / kDepths;
        uint64_t sum = 0;
        for (int k = 0; k < kDepths; ++k) {
            for (const auto &mine : counts)
                if (!mine.empty()) sum += mine[part * kDepths + k];
            if (sum >= limit) return view.depth(view.near + step * float(k + 1));
        }
        return 2;
    }

    static void add_segment(const View &view, const ScreenStrand &s, int j, uint32_t *counts) {
        const float dx = s.x[j + 1] - s.x[j], dy = s.y[j + 1] - s.y[j];
        const float area = std::sqrt(dx * dx + dy * dy) * (s.h[j] + s.h[j + 1]);
        const uint32_t share = uint32_t(std::min(area * (kUnit / kSamples) + 0.5f, 1e6f));
        const float steps = kDepths / (view.far - view.near);
        for (int k = 0; k < kSamples; ++k) {
            const float t = (k + 0.5f) / kSamples, x = s.x[j] + dx * t, y = s.y[j] + dy * t;
            if (!(x >= 0 && y >= 0 && x < view.W && y < view.H)) continue;
            const float distance = s.cw[j] + (s.cw[j + 1] - s.cw[j]) * t;
            const int depth = int(std::min((distance - view.near) * steps, kDepths - 1.0f));
            const int part = int(y) % kTile / kCell * (kTile / kCell) + int(x) % kTile / kCell;
            counts[(size_t(view.tile(int(x) / kTile, int(y) / kTile)) * kParts + part) * kDepths + depth] += share;
        }
    }
};

} // namespace ringlet
