// Compositing the segments of a tile, front to back, over a picture of what is no hair.
//
// Notation: T transmittance of each cell of a pixel, 1 where nothing covers it; a fragment of coverage c takes T c of
// it. Segments come sorted by their depth near the tile's middle; within a pixel that is not exact, so each pixel holds
// back the nearest two fragments until a third comes (a reorder window). A pixel whose mean T is below kClosed is closed.
#pragma once

#include "bins.hpp"
#include "coverage.hpp"

namespace ringlet {

/// The picture that hair is drawn over: samples n x n a pixel, top row first.
struct Backdrop {
    const float *depth;     // (H n, W n)
    const uint8_t *samples; // (H n, W n, 3), encoded
    const float *decode;    // (256,) linear value of each byte
    int n;

    size_t sample(const View &view, int x, int y, int i, int j) const {
        return (size_t(y) * n + j) * (size_t(view.W) * n) + size_t(x) * n + i;
    }

    /// The sample that cell k of 4 along an axis lies in, and the cell that sample k lies in.
    int sample_of(int k) const { return (2 * k + 1) * n / (2 * kCells); }
    int cell_of(int k) const { return (2 * k + 1) * kCells / (2 * n); }
};

/// A tile while it is drawn.
class Tile {
  public:
    static constexpr int kPixels = kTile * kTile;
    static constexpr int kWindow = 2;
    static constexpr float kClosed = 1.0f / 256;

    /// Draws the sorted entries in the pixels that are wanted. Returns those that may lack hair from behind the cut-off.
    TilePixels draw(const View &view, const Bins &bins, const uint64_t *entry, size_t count, const Backdrop &back, int tile,
                    const TilePixels &wanted) {
        const int left = tile % view.across() * kTile, top = tile / view.across() * kTile;
        drawn_ = wanted;
        begin(view, back, left, top);
        // What was left out lies behind the cut-off: only what happens before it is certain
        uint32_t certain;
        std::memcpy(&certain, &bins.cut[tile], sizeof certain);
        TilePixels lacking{};
        bool passed = false;
        for (size_t k = 0; k < count && open_count_ > 0; ++k) {
            if (!passed && entry[k] >> 32 > certain) lacking = open_beyond(bins.cut[tile]), passed = true;
            if (k + kAhead < count) __builtin_prefetch(&bins.segment(uint32_t(entry[k + kAhead])));
            segment(bins.segment(uint32_t(entry[k])), float(left), float(top), view, back);
        }
        if (!passed) lacking = open_beyond(bins.cut[tile]);
        for (int p = 0; p < kPixels; ++p)
            for (int i = 0; i < held_[p]; ++i) composite(p, window_[p][i], view, back, left, top);
        return lacking;
    }

    /// Writes the pixels that were drawn, linear RGB, into a picture (H, W, 3).
    void write(const View &view, const Backdrop &back, int tile, float *picture) const {
        const int left = tile % view.across() * kTile, top = tile / view.across() * kTile;
        for (int p = 0; p < kPixels; ++p) {
            const int x = left + p % kTile, y = top + p / kTile;
            if (x >= view.W || y >= view.H || !(drawn_.row[p / kTile] >> (p % kTile) & 1)) continue;
            float behind[3];
            seen_behind(view, back, p, x, y, behind);
            float *to = picture + 3 * (size_t(y) * view.W + x);
            // What a closed pixel has not seen is as the rest of it
            const bool open = is_open(p);
            const float scale = open ? 1 : 1 / (1 - clear_[p]);
            for (int c = 0; c < 3; ++c) to[c] = colour_[p][c] * scale + (open ? behind[c] : 0);
        }
    }

  private:
    static constexpr int kAhead = 6;

    Cells T_[kPixels];
    float clear_[kPixels], colour_[kPixels][3];      // mean of T; linear RGB
    float nearest_[kPixels], farthest_[kPixels];     // depth of the backdrop
    Fragment window_[kPixels][kWindow];
    uint8_t held_[kPixels];
    uint32_t open_rows_[kTile], open_columns_[kTile]; // a bit for each pixel that is open
    TilePixels drawn_;
    int open_count_;
    CellCentres centres_;

    /// The pixels that are open and see beyond a depth.
    TilePixels open_beyond(float depth) const {
        TilePixels pixels{};
        for (int p = 0; p < kPixels; ++p)
            if (is_open(p) && farthest_[p] > depth) pixels.row[p / kTile] |= 1u << p % kTile;
        return pixels;
    }

    bool is_open(int p) const { return open_rows_[p / kTile] >> (p % kTile) & 1; }

    void close(int p) {
        open_rows_[p / kTile] &= ~(1u << p % kTile);
        open_columns_[p % kTile] &= ~(1u << p / kTile);
        --open_count_;
    }

    void begin(const View &view, const Backdrop &back, int left, int top) {
        std::fill(open_rows_, open_rows_ + kTile, (1u << kTile) - 1);
        std::fill(open_columns_, open_columns_ + kTile, (1u << kTile) - 1);
        open_count_ = kPixels;
        for (int p = 0; p < kPixels; ++p) {
            const int x = left + p % kTile, y = top + p / kTile;
            T_[p] = splat(1.0f), clear_[p] = 1, held_[p] = 0;
            std::fill(colour_[p], colour_[p] + 3, 0.0f);
            nearest_[p] = 2, farthest_[p] = -1;
            if (x >= view.W || y >= view.H || !(drawn_.row[p / kTile] >> (p % kTile) & 1)) {
                close(p);
                continue;
            }
            for (int j = 0; j < back.n; ++j)
                for (int i = 0; i < back.n; ++i) {
                    const float d = back.depth[back.sample(view, x, y, i, j)];
                    nearest_[p] = std::min(nearest_[p], d), farthest_[p] = std::max(farthest_[p], d);
                }
        }
    }

    /// Adds the fragments of a segment, pixel by pixel along its steeper axis.
    void segment(const Segment &s, float left, float top, const View &view, const Backdrop &back) {
        const float x0 = s.x[0] - left, y0 = s.y[0] - top, dx = s.x[1] - s.x[0], dy = s.y[1] - s.y[0];
        const float length = std::sqrt(dx * dx + dy * dy);
        if (length < 1e-4f) return;
        const float ux = dx / length, uy = dy / length, margin = 0.02f, half = std::max(s.h[0], s.h[1]);
        const bool steep = std::abs(uy) >= std::abs(ux);
        const float p0 = steep ? y0 : x0, q0 = steep ? x0 : y0, up = steep ? uy : ux, uq = steep ? ux : uy;
        const float p1 = p0 + up * length, reach = half * std::abs(uq) + 0.5f * margin;
        const int first = std::max(0, int(std::floor(std::max(std::min(p0, p1) - reach, -1.0f))));
        const int last = std::min(kTile - 1, int(std::floor(std::min(std::max(p0, p1) + reach, float(kTile)))));
        const float slope = uq / up, wide = (half + margin) / std::abs(up) + (0.5f - margin) * std::abs(slope);
        const uint32_t *open = steep ? open_rows_ : open_columns_;
        for (int p = first; p <= last; ++p) {
            const float middle = q0 + (p + 0.5f - p0) * slope;
            const int a = int(std::min(std::max(std::floor(middle - wide), 0.0f), float(kTile)));
            const int b = int(std::max(std::min(std::floor(middle + wide), kTile - 1.0f), -1.0f));
            if (a > b) continue;
            for (uint32_t bits = open[p] & ((2u << b) - (1u << a)); bits; bits &= bits - 1) {
                const int q = __builtin_ctz(bits), x = steep ? q : p, y = steep ? p : q;
                const float fx = x + 0.5f - x0, fy = y + 0.5f - y0, along = fx * ux + fy * uy;
                const float t = std::min(std::max(along / length, 0.0f), 1.0f), d = s.d[0] + t * (s.d[1] - s.d[0]);
                const int pixel = y * kTile + x;
                if (d > farthest_[pixel]) continue;
                Fragment f{d, along, fy * ux - fx * uy, length, s.h[0] + t * (s.h[1] - s.h[0]), -uy, ux, {}};
                for (int c = 0; c < 3; ++c) f.colour[c] = s.colour[0][c] + t * (s.colour[1][c] - s.colour[0][c]);
                hold(pixel, f, view, back, int(left), int(top));
            }
        }
    }

    /// Puts a fragment into its pixel's window; what the window has no room for is composited, the nearest first.
    void hold(int p, const Fragment &f, const View &view, const Backdrop &back, int left, int top) {
        Fragment *window = window_[p];
        const int held = held_[p];
        if (held < kWindow) {
            int i = held;
            for (; i > 0 && window[i - 1].depth > f.depth; --i) window[i] = window[i - 1];
            window[i] = f;
            held_[p] = uint8_t(held + 1);
        } else if (f.depth < window[0].depth) {
            composite(p, f, view, back, left, top);
        } else {
            composite(p, window[0], view, back, left, top);
            int i = 1;
            for (; i < kWindow && window[i].depth <= f.depth; ++i) window[i - 1] = window[i];
            window[i - 1] = f;
        }
    }

    RINGLET_INLINE void composite(int p, const Fragment &f, const View &view, const Backdrop &back, int left, int top) {
        if (!is_open(p)) return;
        Cells part = covered(f, centres_);
        if (f.depth > nearest_[p]) part = in_front(part, f.depth, view, back, left + p % kTile, top + p / kTile);
        const Cells taken = T_[p] * part;
        T_[p] -= taken;
        const float weight = sum_cells(taken) * (1.0f / (kCells * kCells));
        for (int c = 0; c < 3; ++c) colour_[p][c] += weight * f.colour[c];
        clear_[p] -= weight;
        if (clear_[p] < kClosed) close(p);
    }

    /// Coverage of the cells whose backdrop is not in front of the depth.
    static Cells in_front(Cells part, float depth, const View &view, const Backdrop &back, int x, int y) {
        for (int k = 0; k < kCells * kCells; ++k) {
            const int i = back.sample_of(k % kCells), j = back.sample_of(k / kCells);
            if (depth > back.depth[back.sample(view, x, y, i, j)]) part[k] = 0;
        }
        return part;
    }

    /// Linear RGB of the backdrop times what is seen of it.
    void seen_behind(const View &view, const Backdrop &back, int p, int x, int y, float behind[3]) const {
        float sum[3] = {}, plain[3] = {}, seen = 0;
        for (int j = 0; j < back.n; ++j)
            for (int i = 0; i < back.n; ++i) {
                const uint8_t *at = back.samples + 3 * back.sample(view, x, y, i, j);
                const float T = T_[p][back.cell_of(j) * kCells + back.cell_of(i)];
                for (int c = 0; c < 3; ++c) sum[c] += T * back.decode[at[c]], plain[c] += back.decode[at[c]];
                seen += T;
            }
        const float all = float(back.n * back.n);
        for (int c = 0; c < 3; ++c) behind[c] = seen > 0 ? clear_[p] * sum[c] / seen : clear_[p] * plain[c] / all;
    }
};

} // namespace ringlet
