// Compositing the segments of a tile, front to back, over a picture of what is no hair.
//
// Notation: T transmittance of each cell of a pixel, 1 where nothing covers it; a fragment of coverage c takes T c of
// it. Segments come sorted by their depth near the tile's middle; within a pixel that is not exact, so each pixel holds
// back the nearest two fragments until a third comes (a reorder window). A pixel whose mean T is below kClosed is closed.
#pragma once

#include "bins.hpp"
#include "coverage.hpp"
#include "elementary.hpp"

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

/// A fragment in a pixel: the bits of its depth, which sort as it does, before the segment's number + 1; 0 is none.
RINGLET_INLINE uint64_t fragment(float depth, uint32_t number) {
    uint32_t bits;
    std::memcpy(&bits, &depth, sizeof bits);
    return uint64_t(bits) << 32 | (number + 1);
}

/// A tile while it is drawn.
class Tile {
  public:
    static constexpr int kPixels = kTile * kTile;
    static constexpr int kWindow = 2;
    static constexpr float kClosed = 1.0f / 64;

    /// With names, notes which segment takes most of each pixel.
    Tile(const View &view, const Backdrop &back, bool names) : view_(view), back_(back), names_(names) {}

    /// Starts a tile, of which these pixels are wanted.
    void begin(int tile, const TilePixels &wanted) {
        left_ = view_.left(tile), top_ = view_.top(tile);
        drawn_ = wanted;
        open_ = TilePixels::all();
        open_count_ = kPixels;
        std::memset(window_, 0, sizeof window_);
        std::memset(colour_, 0, sizeof colour_);
        std::memset(most_, 0, sizeof most_);
        for (int p = 0; p < kPixels; ++p) {
            const int x = left_ + p % kTile, y = top_ + p / kTile;
            T_[p] = splat(1.0f), clear_[p] = 1;
            nearest_[p] = 2, farthest_[p] = -1;
            if (x >= view_.W || y >= view_.H || !drawn_.has(p % kTile, p / kTile)) {
                close(p);
                continue;
            }
            for (int j = 0; j < back_.n; ++j)
                for (int i = 0; i < back_.n; ++i) {
                    const float d = back_.depth[back_.sample(view_, x, y, i, j)];
                    nearest_[p] = std::min(nearest_[p], d), farthest_[p] = std::max(farthest_[p], d);
                }
        }
    }

    bool closed() const { return open_count_ == 0; }

    /// Writes the backdrop into these pixels of a tile without hair.
    void bare(int tile, const TilePixels &wanted, float *picture) const {
        const int left = view_.left(tile), top = view_.top(tile);
        for (int y = top; y < std::min(top + kTile, view_.H); ++y)
            for (int x = left; x < std::min(left + kTile, view_.W); ++x) {
                if (!wanted.has(x - left, y - top)) continue;
                float sum[3] = {};
                for (int j = 0; j < back_.n; ++j)
                    for (int i = 0; i < back_.n; ++i) {
                        const uint8_t *at = back_.samples + 3 * back_.sample(view_, x, y, i, j);
                        for (int c = 0; c < 3; ++c) sum[c] += back_.decode[at[c]];
                    }
                for (int c = 0; c < 3; ++c) picture[3 * (size_t(y) * view_.W + x) + c] = sum[c] / float(back_.n * back_.n);
            }
    }

    /// The open pixels that a segment may touch, for `draw`.
    RINGLET_INLINE Words reached(const Segment &s) const { return crossed(s, float(left_), float(top_), open_, step_); }

    /// Adds the fragments of segment `number` of the block, in the pixels that are still open of those it has reached.
    RINGLET_INLINE void draw(const Segment *segments, uint32_t number, const Words &reached) {
        const Segment &s = segments[number];
        const bool rows = steep(s);
        const Words open = reached & (rows ? open_.rows : open_.columns);
        alignas(64) uint32_t pixels[kTile];
        std::memcpy(pixels, &open, sizeof pixels);
        for (uint32_t left = set_lanes<float>((Mask<float>)open != 0); left; left &= left - 1) {
            const int p = __builtin_ctz(left);
            for (uint32_t bits = pixels[p]; bits; bits &= bits - 1) {
                const int q = __builtin_ctz(bits), pixel = rows ? p * kTile + q : q * kTile + p;
                const float d = s.d + crossing(s, pixel).t * s.dd;
                if (d <= farthest_[pixel]) hold(segments, pixel, fragment(d, number));
            }
        }
    }

    /// Composites what is held back.
    void finish(const Segment *segments) {
        for (int p = 0; p < kPixels; ++p)
            for (const uint64_t held : window_[p])
                if (held) composite(segments, p, held);
    }

    /// The pixels that are open and see beyond a depth.
    TilePixels open_beyond(float depth) const {
        TilePixels pixels = TilePixels::none();
        for (int p = 0; p < kPixels; ++p)
            if (is_open(p) && farthest_[p] > depth) pixels.add(p % kTile, p / kTile);
        return pixels;
    }

    /// Writes the pixels that were drawn, linear RGB, into a picture (H, W, 3).
    void write(float *picture) const {
        for (int p = 0; p < kPixels; ++p) {
            const int x = left_ + p % kTile, y = top_ + p / kTile;
            if (x >= view_.W || y >= view_.H || !drawn_.has(p % kTile, p / kTile)) continue;
            float behind[3];
            seen_behind(p, x, y, behind);
            float *to = picture + 3 * (size_t(y) * view_.W + x);
            // What a closed pixel has not seen is as the rest of it
            const bool open = is_open(p);
            const float scale = open ? 1 : 1 / (1 - clear_[p]);
            for (int c = 0; c < 3; ++c) to[c] = colour_[p][c] * scale + (open ? behind[c] : 0);
        }
    }

    /// Calls visit(x, y, number) for the pixels that were drawn: `number` of the segment that takes most, -1 if none.
    template <class Visit> void name(Visit &&visit) const {
        for (int p = 0; p < kPixels; ++p) {
            const int x = left_ + p % kTile, y = top_ + p / kTile;
            if (x < view_.W && y < view_.H && drawn_.has(p % kTile, p / kTile)) visit(x, y, most_[p].part > 0 ? int(most_[p].number) : -1);
        }
    }

  private:
    struct Most {
        float part;
        uint32_t number;
    };

    const View &view_;
    const Backdrop &back_;
    const bool names_;
    int left_ = 0, top_ = 0; // [px]
    Cells T_[kPixels];
    float clear_[kPixels], colour_[kPixels][3];  // mean of T; linear RGB
    float nearest_[kPixels], farthest_[kPixels]; // depth of the backdrop
    uint64_t window_[kPixels][kWindow];          // fragments, ascending
    Most most_[kPixels];
    TilePixels open_, drawn_;
    int open_count_ = 0;
    CellCentres centres_;
    TileSteps step_;

    bool is_open(int p) const { return open_.has(p % kTile, p / kTile); }

    void close(int p) {
        open_.remove(p % kTile, p / kTile);
        --open_count_;
    }

    RINGLET_INLINE Crossing crossing(const Segment &s, int p) const {
        return Crossing(s, float(left_ + p % kTile) + 0.5f, float(top_ + p / kTile) + 0.5f);
    }

    /// Puts a fragment into its pixel's window; the nearest that the window has no room for is composited.
    RINGLET_INLINE void hold(const Segment *segments, int p, uint64_t next) {
        uint64_t *window = window_[p];
        const uint64_t out = std::min(next, window[0]);
        for (int i = 0; i < kWindow; ++i) {
            const uint64_t later = std::max(next, window[i]);
            window[i] = i + 1 < kWindow ? std::min(later, window[i + 1]) : later;
            next = later;
        }
        if (out) composite(segments, p, out);
    }

    RINGLET_INLINE void composite(const Segment *segments, int p, uint64_t held) {
        if (!is_open(p)) return;
        const Segment &s = segments[uint32_t(held) - 1];
        const Crossing at = crossing(s, p);
        Cells part = covered(s, at, centres_);
        const float depth = s.d + at.t * s.dd;
        if (depth > nearest_[p]) part = in_front(part, depth, left_ + p % kTile, top_ + p / kTile);
        const Cells taken = T_[p] * part;
        T_[p] -= taken;
        const float weight = sum_cells(taken) * (1.0f / (kCells * kCells));
        for (int c = 0; c < 3; ++c) colour_[p][c] += weight * (s.colour[c] + at.t * s.gain[c]);
        clear_[p] -= weight;
        if (names_ && weight > most_[p].part) most_[p] = {weight, uint32_t(held) - 1};
        if (clear_[p] < kClosed) close(p);
    }

    /// Coverage of the cells whose backdrop is not in front of the depth.
    Cells in_front(Cells part, float depth, int x, int y) const {
        for (int k = 0; k < kCells * kCells; ++k) {
            const int i = back_.sample_of(k % kCells), j = back_.sample_of(k / kCells);
            if (depth > back_.depth[back_.sample(view_, x, y, i, j)]) part[k] = 0;
        }
        return part;
    }

    /// Linear RGB of the backdrop times what is seen of it.
    void seen_behind(int p, int x, int y, float behind[3]) const {
        float sum[3] = {}, plain[3] = {}, seen = 0;
        for (int j = 0; j < back_.n; ++j)
            for (int i = 0; i < back_.n; ++i) {
                const uint8_t *at = back_.samples + 3 * back_.sample(view_, x, y, i, j);
                const float T = T_[p][back_.cell_of(j) * kCells + back_.cell_of(i)];
                for (int c = 0; c < 3; ++c) sum[c] += T * back_.decode[at[c]], plain[c] += back_.decode[at[c]];
                seen += T;
            }
        const float all = float(back_.n * back_.n);
        for (int c = 0; c < 3; ++c) behind[c] = seen > 0 ? clear_[p] * sum[c] / seen : clear_[p] * plain[c] / all;
    }
};

} // namespace ringlet
