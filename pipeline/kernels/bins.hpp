// Which segments may be seen, and in which blocks of tiles.
//
// A segment is left out where it lies behind the cut-off depth of every tile that it touches. What is kept has a
// number that grows with the strand's, so that neither threads nor chunks change any order. Strands of which something
// is kept stay in memory, for their points are shaded once it is known which of them are seen.
#pragma once

#include "arena.hpp"
#include "blocks.hpp"

#include <cstring>

namespace ringlet {

/// A chunk of strands: points (S, P, 3) [m], widths (S, P) [m], and what shading needs of each strand.
struct StrandChunk {
    const float *points, *widths;
    const float *variation; // (S, 3)
    const uint32_t *key;     // (S,)
    int S, P;
};

/// A segment in a block.
struct Entry {
    uint32_t block, segment;
};

/// A point of a segment that may be seen.
struct SeenPoint {
    static constexpr uint32_t kKnown = 1u << 31;

    float colour[3]; // linear RGB, once it is known
    uint32_t number; // of the point among those of the batch's strands, and whether its colour is known
};

/// Strands that are looked at together. Segment k runs from point k to point k + 1 of those that are seen.
struct Batch {
    static constexpr int kBits = 16;

    Span<ScreenPoint> at; // apart from the rest, for each block looks at all of its segments
    Span<SeenPoint> seen;
    std::vector<Entry> entries; // until they are sorted by blocks
    Span<float> points, variation; // (n, P, 3) and (n, 3) of the n strands of which something is seen
    Span<uint32_t> key;             // (n,)
};

/// A batch while it grows.
struct OpenBatch {
    std::vector<ScreenPoint> at;
    std::vector<SeenPoint> seen;
    std::vector<Entry> entries;
    std::vector<float> points, variation;
    std::vector<uint32_t> key;

    void clear() { at.clear(), seen.clear(), entries.clear(), points.clear(), variation.clear(), key.clear(); }

    Batch store(Arena &arena) const {
        return {arena.copy(at), arena.copy(seen), std::vector<Entry>(entries), arena.copy(points), arena.copy(variation), arena.copy(key)};
    }
};

/// Cut-off depths, and the segments in front of them.
struct Bins {
    std::vector<float> cut; // (tiles,); negative: nothing is wanted here
    std::vector<TilePixels> wanted; // (tiles,) or empty: pixels that segments must touch
    std::vector<Batch> batches;
    Arena arena; // where the batches lie
    int P = 0;

    // Each point may be there twice, where the near plane or another segment's absence parts the strand
    static int strands_per_batch(int P) { return std::max(1, std::min(1024, (1 << Batch::kBits) / (2 * P))); }

    const Batch &batch(uint32_t number) const { return batches[number >> Batch::kBits]; }
    const ScreenPoint *at(uint32_t number) const { return batch(number).at.data + place(number); }
    SeenPoint *seen(uint32_t number) const { return batch(number).seen.data + place(number); }

    void clear() { batches.clear(), arena.clear(); }

    /// Looks at a chunk of strands.
    void add(const View &view, const StrandChunk &strands, int threads) {
        P = strands.P;
        const int step = strands_per_batch(P), count = (strands.S + step - 1) / step;
        const size_t first = batches.size();
        const std::vector<float> around = widest(view);
        batches.resize(first + count);
#pragma omp parallel num_threads(threads)
        {
            Sieve sieve{view, cut, around, wanted, strands, ScreenStrand(P), {}, {}, {}};
#pragma omp for schedule(dynamic, 1)
            for (int b = 0; b < count; ++b) {
                const uint32_t name = uint32_t(first + b) << Batch::kBits;
                sieve.batch.clear();
                for (int s = b * step; s < std::min(strands.S, (b + 1) * step); ++s) sieve.strand(s, name);
                batches[first + b] = sieve.batch.store(arena);
            }
        }
    }

  private:
    static uint32_t place(uint32_t number) { return number & ((1u << Batch::kBits) - 1); }

    /// The largest cut-off of each tile and its eight neighbours, row by row.
    std::vector<float> widest(const View &view) const {
        const int across = view.across() * kSide, down = view.down() * kSide;
        std::vector<float> around(cut.size());
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x) {
                float most = -1;
                for (int b = std::max(0, y - 1); b <= std::min(down - 1, y + 1); ++b)
                    for (int a = std::max(0, x - 1); a <= std::min(across - 1, x + 1); ++a)
                        most = std::max(most, cut[view.tile(a, b)]);
                around[size_t(y) * across + x] = most;
            }
        return around;
    }

    struct Sieve {
        const View &view;
        const std::vector<float> &cut, &around;
        const std::vector<TilePixels> &wanted;
        const StrandChunk &strands;
        ScreenStrand at;
        TileMiddles middle;
        TileSteps step;
        OpenBatch batch;

        /// Keeps the segments that may be seen of a strand.
        void strand(int s, uint32_t name) {
            const int P = strands.P;
            const float *points = strands.points + size_t(s) * 3 * P, *widths = strands.widths + size_t(s) * P;
            const bool whole = at.project(view, points, widths, P);
            if (whole) at.h[0] = -at.h[0], at.h[P - 1] = -at.h[P - 1]; // as ScreenPoint has it
            const uint32_t first = uint32_t(batch.key.size()) * uint32_t(P);
            int last = -2; // segment that was kept last
            for (int begin = 0; begin + 1 < P; begin += kLanes<float>) {
                // Where the strand passes the near plane nothing can be said of its points
                uint32_t passed = whole ? quick(begin) : (1u << std::min(P - 1 - begin, kLanes<float>)) - 1;
                for (; passed; passed &= passed - 1) keep(begin + __builtin_ctz(passed), widths, whole, name, first, last);
            }
            if (last < 0) return;
            batch.points.insert(batch.points.end(), points, points + 3 * P);
            batch.variation.insert(batch.variation.end(), strands.variation + 3 * size_t(s), strands.variation + 3 * size_t(s) + 3);
            batch.key.push_back(strands.key[s]);
        }

        /// Keeps segment j if it may be seen.
        void keep(int j, const float *widths, bool whole, uint32_t name, uint32_t first, int &last) {
            ScreenPoint ends[2] = {{at.x[j], at.y[j], at.d[j], at.h[j]}, {at.x[j + 1], at.y[j + 1], at.d[j + 1], at.h[j + 1]}};
            if (!whole && !clipped(view, at, widths, strands.P, j, ends)) return;
            const bool goes_on = whole && last == j - 1; // then the last point is there already
            const uint32_t segment = uint32_t(batch.seen.size()) - (goes_on ? 1 : 0);
            if (!visible(Segment(ends[0], ends[1]), distance(ends[0], ends[1]), name | segment)) return;
            // A point that the near plane has moved keeps its colour
            for (int end = goes_on ? 1 : 0; end < 2; ++end) {
                batch.at.push_back(ends[end]);
                batch.seen.push_back({{}, first + j + end});
            }
            last = j;
        }

        /// The segments from the j-th on that the tiles of their ends do not rule out, a bit for each of up to 16.
        RINGLET_INLINE uint32_t quick(int j) const {
            constexpr float margin = 2, per_tile = 1.0f / kTile;
            const int across = view.across() * kSide;
            const Floats x0 = read(at.x, j), y0 = read(at.y, j), d0 = read(at.d, j), h0 = read(at.h, j);
            const Floats x1 = read(at.x, j + 1), y1 = read(at.y, j + 1), d1 = read(at.d, j + 1), h1 = read(at.h, j + 1);
            const Floats wide = margin + maximum<float>(magnitude(h0), magnitude(h1));
            const Mask<float> inside = (maximum<float>(x0, x1) > -wide) & (minimum<float>(x0, x1) < float(view.W) + wide) &
                                       (maximum<float>(y0, y1) > -wide) & (minimum<float>(y0, y1) < float(view.H) + wide);
            const float columns = float(across - 1), rows = float(view.down() * kSide - 1);
            const Mask<float> a0 = place(x0 * per_tile, columns), a1 = place(x1 * per_tile, columns);
            const Mask<float> b0 = place(y0 * per_tile, rows), b1 = place(y1 * per_tile, rows);
            const Mask<float> a = place((x0 + x1) * (0.5f * per_tile), columns), b = place((y0 + y1) * (0.5f * per_tile), rows);
            // The tiles around the middle join those around the ends as long as the ends are no more than four tiles apart
            const Floats deepest = maximum<float>(maximum<float>(at_most(b0 * across + a0), at_most(b1 * across + a1)), at_most(b * across + a));
            const Mask<float> far = (a0 - a1 > 4) | (a1 - a0 > 4) | (b0 - b1 > 4) | (b1 - b0 > 4) | (wide > float(kTile));
            const uint32_t passed = set_lanes<float>(inside & (far | (minimum<float>(d0, d1) <= deepest)));
            return passed & ((1u << std::min(strands.P - 1 - j, 16)) - 1);
        }

        RINGLET_INLINE Floats at_most(Mask<float> tile) const { return gather_floats(around.data(), tile); }

        static RINGLET_INLINE Floats read(const std::vector<float> &from, int j) {
            Floats lanes;
            std::memcpy(&lanes, from.data() + j, sizeof lanes);
            return lanes;
        }

        static RINGLET_INLINE Mask<float> place(Floats x, float last) {
            return __builtin_convertvector(minimum<float>(maximum<float>(x, splat(0.0f)), splat(last)), Mask<float>);
        }

        /// Enters a segment into the blocks where it may be seen; whether there are any.
        bool visible(const Segment &s, float length, uint32_t number) {
            if (!s.drawable(length)) return false;
            bool some = false;
            visit_blocks(view, s, length, [&](int block, float left, float top) {
                if (!seen_in(s, length, block, left, top)) return;
                batch.entries.push_back({uint32_t(block), number});
                some = true;
            });
            return some;
        }

        bool seen_in(const Segment &s, float length, int block, float left, float top) const {
            constexpr int count = kSide * kSide;
            const Touch touch(s, length, middle, left, top);
            TileLanes before;
            std::memcpy(&before, &cut[size_t(block) * count], sizeof before);
            const uint32_t tiles = set_lanes<float>(touch.tiles & (touch.nearest <= before));
            if (wanted.empty()) return tiles != 0;
            for (uint32_t bits = tiles; bits; bits &= bits - 1) {
                const int k = __builtin_ctz(bits);
                const Words pixels = crossed(s, left + float(k % kSide * kTile), top + float(k / kSide * kTile), wanted[block * count + k], step);
                if (any<float>((Mask<float>)pixels != 0)) return true;
            }
            return false;
        }
    };
};

} // namespace ringlet
