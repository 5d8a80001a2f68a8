// Which segments may be seen, sorted into the tiles that they touch.
//
// A segment is left out where it lies behind the cut-off depth of every tile that it touches. What is kept has a
// number that grows with the strand's, so that neither threads nor chunks change any order.
#pragma once

#include "screen.hpp"

#include <array>
#include <cstring>

namespace ringlet {

/// A segment in a tile; sorted by depth, then by the order of strands.
struct Entry {
    uint32_t tile, depth, segment; // depth: the bits of a positive float, which sort as it does
};

/// What a segment's colours are made of, until they are known: two points, and where between them it begins and ends.
struct Uncoloured {
    uint32_t point[2]; // numbers among the points that are seen
    float t[2];
};

/// Strands that are looked at together.
struct Batch {
    static constexpr int kBits = 16;

    std::vector<Segment> segments;
    std::vector<Entry> entries;
    std::vector<Uncoloured> uncoloured;
    std::vector<uint32_t> seen; // points of the chunk, ascending
};

/// Cut-off depths, and the segments in front of them.
struct Bins {
    std::vector<float> cut; // (tiles,); negative: nothing is wanted here
    std::vector<TilePixels> wanted; // (tiles,) or empty: pixels that segments must touch
    std::vector<Batch> batches;
    size_t waiting = 0; // first batch without colours

    static int strands_per_batch(int P) { return std::max(1, std::min(1024, ((1 << Batch::kBits) - 1) / (P - 1))); }

    const Segment &segment(uint32_t number) const {
        return batches[number >> Batch::kBits].segments[number & ((1u << Batch::kBits) - 1)];
    }

    /// Looks at strands (S, P); their segments wait for colours.
    void add(const View &view, const float *points, const float *widths, int S, int P, int threads) {
        const int step = strands_per_batch(P), count = (S + step - 1) / step;
        const size_t first = batches.size();
        const std::vector<float> around = widest(view);
        batches.resize(first + count);
#pragma omp parallel num_threads(threads)
        {
            Sieve sieve{view, cut, around, wanted, ScreenStrand(P), std::vector<int>(P), std::vector<int>(P)};
#pragma omp for schedule(dynamic, 1)
            for (int b = 0; b < count; ++b) {
                Batch &batch = batches[first + b];
                const uint32_t name = uint32_t(first + b) << Batch::kBits;
                for (int s = b * step; s < std::min(S, (b + 1) * step); ++s)
                    sieve.strand(points, widths, size_t(s) * P, P, name, batch);
                batch.segments.shrink_to_fit();
                batch.entries.shrink_to_fit();
            }
        }
        waiting = first;
    }

    /// How many points are seen in the chunk that was added last.
    size_t seen() const {
        size_t count = 0;
        for (size_t b = waiting; b < batches.size(); ++b) count += batches[b].seen.size();
        return count;
    }

    /// Gives the chunk that was added last its colours, linear RGB (points that are seen, 3).
    void colour(const float *colours, int threads) {
        std::vector<size_t> begin{0};
        for (size_t b = waiting; b < batches.size(); ++b) begin.push_back(begin.back() + batches[b].seen.size());
        const ptrdiff_t count = ptrdiff_t(batches.size() - waiting);
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads)
        for (ptrdiff_t b = 0; b < count; ++b) {
            Batch &batch = batches[waiting + b];
            for (size_t i = 0; i < batch.segments.size(); ++i) {
                const Uncoloured &from = batch.uncoloured[i];
                const float *a = colours + 3 * (begin[b] + from.point[0]), *e = colours + 3 * (begin[b] + from.point[1]);
                for (int end = 0; end < 2; ++end)
                    for (int c = 0; c < 3; ++c) batch.segments[i].colour[end][c] = a[c] + from.t[end] * (e[c] - a[c]);
            }
            batch.uncoloured = {};
            batch.seen = {};
        }
        waiting = batches.size();
    }

  private:
    /// The largest cut-off of each tile and its eight neighbours.
    std::vector<float> widest(const View &view) const {
        const int across = view.across(), down = view.down();
        std::vector<float> around(cut.size());
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x) {
                float most = -1;
                for (int b = std::max(0, y - 1); b <= std::min(down - 1, y + 1); ++b)
                    for (int a = std::max(0, x - 1); a <= std::min(across - 1, x + 1); ++a)
                        most = std::max(most, cut[size_t(b) * across + a]);
                around[size_t(y) * across + x] = most;
            }
        return around;
    }

    struct Sieve {
        const View &view;
        const std::vector<float> &cut, &around;
        const std::vector<TilePixels> &wanted;
        ScreenStrand at;
        std::vector<int> passed, number;

        /// Keeps the segments that may be seen of the strand whose first point has the number `first` in the chunk.
        void strand(const float *points, const float *widths, size_t first, int P, uint32_t name, Batch &batch) {
            const bool whole = at.project(view, points + 3 * first, widths + first, P);
            if (!quick(P, whole)) return;
            std::fill(number.begin(), number.end(), -1);
            for (int j = 0; j + 1 < P; ++j)
                if (passed[j]) keep(widths + first, j, first, whole, name, batch);
        }

        /// Marks the segments that the tiles of their ends do not rule out; whether there are any.
        bool quick(int P, bool whole) {
            if (!whole) {
                std::fill(passed.begin(), passed.end(), 1);
                return true;
            }
            constexpr float margin = 2, per_tile = 1.0f / kTile;
            const float W = view.W, H = view.H;
            const int across = view.across();
            const float columns = across - 1, rows = view.down() - 1;
            const float *__restrict x = at.x.data(), *__restrict y = at.y.data(), *__restrict d = at.d.data();
            const float *__restrict h = at.h.data(), *__restrict deep = around.data();
            int *__restrict pass = passed.data(), some = 0;
#pragma omp simd reduction(| : some)
            for (int j = 0; j < P - 1; ++j) {
                const float wide = margin + std::max(h[j], h[j + 1]);
                const int inside = (std::max(x[j], x[j + 1]) > -wide) & (std::min(x[j], x[j + 1]) < W + wide) &
                                    (std::max(y[j], y[j + 1]) > -wide) & (std::min(y[j], y[j + 1]) < H + wide);
                const int a0 = int(std::min(std::max(x[j] * per_tile, 0.0f), columns));
                const int a1 = int(std::min(std::max(x[j + 1] * per_tile, 0.0f), columns));
                const int b0 = int(std::min(std::max(y[j] * per_tile, 0.0f), rows));
                const int b1 = int(std::min(std::max(y[j + 1] * per_tile, 0.0f), rows));
                const float deepest = std::max(deep[b0 * across + a0], deep[b1 * across + a1]);
                const int far = (a0 - a1 > 2) | (a1 - a0 > 2) | (b0 - b1 > 2) | (b1 - b0 > 2) | (wide > kTile);
                pass[j] = inside & (far | (std::min(d[j], d[j + 1]) <= deepest));
                some |= pass[j];
            }
            return some != 0;
        }

        void keep(const float *widths, int j, size_t first, bool whole, uint32_t name, Batch &batch) {
            Segment s;
            float t[2] = {0, 1};
            if (whole) {
                for (int end = 0; end < 2; ++end)
                    s.x[end] = at.x[j + end], s.y[end] = at.y[j + end], s.d[end] = at.d[j + end], s.h[end] = at.h[j + end];
            } else if (!clipped(view, at, widths, j, s, t)) {
                return;
            }
            if (!drawable(s)) return;
            const float dx = s.x[1] - s.x[0], dy = s.y[1] - s.y[0], dd = s.d[1] - s.d[0];
            const float square = dx * dx + dy * dy + 1e-12f, inverse = 1 / square;
            const float nearest = std::min(s.d[0], s.d[1]), spread = std::abs(dd) * 0.75f * kTile / std::sqrt(square);
            const uint32_t segment = name | uint32_t(batch.segments.size());
            bool kept = false;
            const float half = std::max(s.h[0], s.h[1]);
            visit_tiles(view, s, kReach + half, [&](int column, int row) {
                const int tile = row * view.across() + column;
                const float mx = (column + 0.5f) * kTile - s.x[0], my = (row + 0.5f) * kTile - s.y[0];
                const float u = std::min(std::max((mx * dx + my * dy) * inverse, 0.0f), 1.0f), d = s.d[0] + dd * u;
                if (std::max(nearest, d - spread) > cut[tile]) return;
                if (!wanted.empty() && !wanted[tile].touched(s, kReach + half, float(column * kTile), float(row * kTile))) return;
                Entry entry{uint32_t(tile), 0, segment};
                std::memcpy(&entry.depth, &d, sizeof d);
                batch.entries.push_back(entry);
                kept = true;
            });
            if (!kept) return;
            batch.segments.push_back(s);
            batch.uncoloured.push_back({{see(j, first, batch), see(j + 1, first, batch)}, {t[0], t[1]}});
        }

        /// Number of point j of the strand among those of the batch that are seen.
        uint32_t see(int j, size_t first, Batch &batch) {
            if (number[j] < 0) {
                number[j] = int(batch.seen.size());
                batch.seen.push_back(uint32_t(first + j));
            }
            return uint32_t(number[j]);
        }
    };
};

} // namespace ringlet
