// Compositing the segments of a tile, front to back, over a picture of what is no hair.
//
// Notation: T transmittance of each cell of a pixel, 1 where nothing covers it; a fragment of coverage c takes T c of
// it. Segments come sorted by their depth near the tile's middle; within a pixel that is not exact, so each pixel holds
// back the nearest two fragments until a third comes (a reorder window). A pixel whose mean T is below kClosed is closed.
// Where thick layers cross within a tile that is too little: a pixel in which much was taken by fragments that lie
// kBefore in front of what had been taken last is mixed, and is drawn again in the order of a smaller square.
#pragma once

#include "across.hpp"
#include "bins.hpp"
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

/// The fragments of a tile in the order in which they came: what compositing needs of each.
struct Fragments {
    std::vector<int32_t> pixel, depth;      // depth: its bits
    std::vector<int32_t> segment;           // its number, and Tile::kSpecial
    std::vector<float> t, off, reach, most; // part of the segment before the pixel's centre, how far across that lies, the band
    int count = 0;

    /// Makes room for so many more.
    void room(int more) {
        const size_t needed = size_t(count) + size_t(more);
        if (needed <= t.size()) return;
        for (auto *each : {&pixel, &depth, &segment}) each->resize(2 * needed);
        for (auto *each : {&t, &off, &reach, &most}) each->resize(2 * needed);
    }

    /// Adds those that are set.
    RINGLET_INLINE void add(Mask<float> some, Mask<float> in, Floats d, Mask<float> of, Floats part, Floats across, const Band &band) {
        write_chosen(some, in, &pixel[count]), write_chosen(some, (Mask<float>)d, &depth[count]), write_chosen(some, of, &segment[count]);
        pack_set_lanes(some, across, &off[count]), pack_set_lanes(some, band.reach, &reach[count]), pack_set_lanes(some, band.most, &most[count]);
        count += pack_set_lanes(some, part, &t[count]);
    }

    RINGLET_INLINE Band band(uint32_t k) const { return {splat(reach[k]), splat(most[k])}; }
};

/// A tile while it is drawn.
class Tile {
  public:
    static constexpr int kPixels = kTile * kTile;
    static constexpr int kWindow = 2;
    static constexpr float kClosed = 1.0f / 32;
    static constexpr float kBefore = 4e-4f; // [m] in front of what was taken last: out of order
    static constexpr float kMixed = 0.2f;   // part of a pixel out of order from which on it is mixed
    static constexpr float kLast = 0.15f;   // part of a pixel over which "what was taken last" is a mean
    static constexpr int kSquare = 4;       // [px] side of the squares that are drawn again
    static constexpr int kMany = 4;         // mixed pixels in such a square
    static constexpr uint32_t kSpecial = 1u << 31; // of a fragment near an end of its segment, or behind a part of the backdrop

    explicit Tile(const View &view) : view_(view) {}

    /// From now on over another picture. With names, notes which segment takes most of each pixel.
    void over(const Backdrop &back, bool names) { back_ = back, names_ = names; }

    /// The hair of the tile is about as deep as this.
    void around(float depth) { before_ = view_.deeper(depth, kBefore); }

    /// Colours across the block's wide segments; null where it has none.
    void with(const Sides *sides) {
        if (sides == sides_) return;
        sides_ = sides;
        gaps_.assign(sides ? kPixels : 0, Gaps{});
    }

    /// Starts a tile, of which these pixels are wanted.
    void begin(int tile, const TilePixels &wanted) {
        left_ = view_.left(tile), top_ = view_.top(tile);
        for (int k = 0; k < kTile; ++k) x_[k] = float(left_ + k) + 0.5f, y_[k] = float(top_ + k) + 0.5f;
        drawn_ = wanted;
        shallowest_ = 2, closest_ = 2;
        fragments_.count = 0, drawn_to_ = 0;
        std::memset(window_, 0, sizeof window_);
        std::memset(mixed_, 0, sizeof mixed_);
        gaps_.assign(gaps_.size(), Gaps{});
        deepest_ = splat(0.0f);
        std::memset(last_, 0, sizeof last_);
        std::memset(shown_, 0, sizeof shown_);
        std::memset(most_, 0, sizeof most_);
        for (int p = 0; p < kPixels; ++p) {
            const int x = left_ + p % kTile, y = top_ + p / kTile;
            T_[p] = splat(1.0f), clear_[p] = 1;
            nearest_[p] = 2, farthest_[p] = -1;
            if (x >= view_.W || y >= view_.H || !drawn_.has(p % kTile, p / kTile)) {
                clear_[p] = 0;
                continue;
            }
            for (int j = 0; j < back_.n; ++j)
                for (int i = 0; i < back_.n; ++i) {
                    const float d = back_.depth[back_.sample(view_, x, y, i, j)];
                    nearest_[p] = std::min(nearest_[p], d), farthest_[p] = std::max(farthest_[p], d);
                }
            shallowest_ = std::min(shallowest_, farthest_[p]), closest_ = std::min(closest_, nearest_[p]);
        }
        find_open();
    }

    /// Sees which pixels are open: now and then, for to keep account at each fragment costs more than a few too many.
    void find_open() {
        for (int y = 0; y < kTile; ++y) {
            Floats clear;
            std::memcpy(&clear, clear_ + y * kTile, sizeof clear);
            open_.rows[y] = set_lanes<float>(clear >= kClosed);
        }
        for (int x = 0; x < kTile; ++x) open_.columns[x] = set_lanes<float>((Mask<float>)(open_.rows << (31 - x)));
    }

    /// Whether no pixel was open when that was seen last.
    bool closed() const { return !open_.some(); }

    /// Writes the backdrop into these pixels of a tile without hair.
    void bare(int tile, const TilePixels &wanted, float *picture) const {
        const int left = view_.left(tile), top = view_.top(tile), n = back_.n;
        const int columns = std::min(kTile, view_.W - left), rows = std::min(kTile, view_.H - top);
        const float share = 1 / float(n * n);
        for (int y = 0; y < rows; ++y) {
            const uint32_t own = wanted.rows[y];
            float *to = picture + 3 * (size_t(top + y) * view_.W + left);
            const uint8_t *first = back_.samples + 3 * back_.sample(view_, left, top + y, 0, 0);
            for (int x = 0; x < columns; ++x, to += 3) {
                if (!(own >> x & 1)) continue;
                float sum[3] = {};
                for (int j = 0; j < n; ++j)
                    for (int i = 0; i < n; ++i) {
                        const uint8_t *at = first + 3 * ((size_t(j) * view_.W + x) * n + i);
                        for (int c = 0; c < 3; ++c) sum[c] += back_.decode[at[c]];
                    }
                for (int c = 0; c < 3; ++c) to[c] = share * sum[c];
            }
        }
    }

    /// The open pixels that a segment may touch, for `add`.
    RINGLET_INLINE Words reached(const Segment &s) const { return crossed(s, float(left_), float(top_), open_, step_); }

    /// Adds the fragments of segment `number` of the block, in the pixels that are still open of those it has reached.
    RINGLET_INLINE void add(const Segment *segments, uint32_t number, const Words &reached) { fragments(segments[number], number, reached); }

    /// Draws what was added. All fragments of some segments in a row: no loop over few pixels ends unforeseen.
    RINGLET_INLINE void draw(const Segment *segments) {
        const uint32_t count = uint32_t(fragments_.count);
        if (out_.size() <= count - drawn_to_) out_.resize(2 * (count - drawn_to_) + 1);
        size_t out = 0;
        for (; drawn_to_ < count; ++drawn_to_) {
            out_[out] = hold(fragments_.pixel[drawn_to_], int64_t(fragments_.depth[drawn_to_]) << 32 | (drawn_to_ + 1));
            out += out_[out] != 0;
        }
        for (size_t i = 0; i < out; ++i) composite(segments, out_[i] - 1);
    }

    /// Composites what is held back.
    void finish(const Segment *segments) {
        for (int p = 0; p < kPixels; ++p)
            for (int i = 0; i < kWindow; ++i)
                if (window_[p][i]) composite(segments, uint32_t(window_[p][i]) - 1);
    }

    /// The pixels that are open and see beyond a depth.
    TilePixels open_beyond(float depth) const {
        TilePixels pixels = TilePixels::none();
        for (int p = 0; p < kPixels; ++p)
            if (is_open(p) && farthest_[p] > depth) pixels.add(p % kTile, p / kTile);
        return pixels;
    }

    /// The squares of kSquare pixels a side in which much was taken out of order, in kMany of their pixels.
    TilePixels mixed() const {
        TilePixels pixels = TilePixels::none();
        for (int y = 0; y < kTile; y += kSquare)
            for (int x = 0; x < kTile; x += kSquare) {
                int many = 0;
                for (int k = 0; k < kSquare * kSquare; ++k) many += mixed_[(y + k / kSquare) * kTile + x + k % kSquare] > kMixed;
                if (many >= kMany) pixels = pixels | TilePixels::square(x, y, kSquare);
            }
        return pixels & drawn_;
    }

    /// Depth behind which nothing was taken; without an end where a pixel is open.
    float deepest() const {
        return std::any_of(clear_, clear_ + kPixels, [](float clear) { return clear >= kClosed; }) ? 2 : largest<float>(deepest_);
    }

    /// Depth of a segment nearest the middle of the square from column x and row y on.
    float depth(const Segment &s, int x, int y, int side) const {
        const float middle = 0.5f * float(side - 1);
        return s.d() + Crossing(s, x_[x] + middle, y_[y] + middle).t * s.dd();
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
            for (int c = 0; c < 3; ++c) to[c] = shown_[p][c] * scale + (open ? behind[c] : 0);
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
    typedef int64_t Held __attribute__((vector_size(16))); // kWindow fragments

    struct Most {
        float part;
        uint32_t number;
    };

    const View &view_;
    Backdrop back_{};
    bool names_ = false;
    int left_ = 0, top_ = 0; // [px]
    float x_[kTile], y_[kTile]; // [px] of the pixels' centres
    Cells T_[kPixels];
    float clear_[kPixels]; // mean of T; 0 where nothing is drawn
    Shown shown_[kPixels]; // sum of what was taken
    float nearest_[kPixels], farthest_[kPixels]; // depth of the backdrop
    float mixed_[kPixels];                // taken out of order
    float last_[kPixels];                 // mean depth of what was taken last
    float before_ = 0;                    // kBefore as depth
    Floats deepest_;                      // largest depth of fragments
    Held window_[kPixels]; // fragments, ascending
    Most most_[kPixels];
    float shallowest_, closest_; // of the backdrop's farthest and nearest depths
    Fragments fragments_;
    uint32_t drawn_to_ = 0;     // of them
    std::vector<uint32_t> out_; // of the windows: number + 1
    TilePixels open_, drawn_;
    CellCentres centres_;
    TileSteps step_;
    const Sides *sides_ = nullptr;
    std::vector<Gaps> gaps_; // of each pixel, where segments have sides

    bool is_open(int p) const { return clear_[p] >= kClosed; }

    /// The open pixels that a segment has reached, in front of the backdrop.
    RINGLET_INLINE void fragments(const Segment &s, uint32_t number, const Words &reached) {
        const bool rows = steep(s);
        const float deepest = std::max(s.d(), s.d() + s.dd());
        const bool behind = deepest > shallowest_, beside = deepest > closest_;
        const float x = float(left_) - s.x, y = float(top_) - s.y;
        const float line0 = rows ? y : x, first0 = rows ? x : y, by_line = rows ? s.uy : s.ux, by_first = rows ? s.ux : s.uy;
        const float off_line = rows ? s.ux : -s.uy, off_first = rows ? -s.uy : s.ux, end = kNearEnd * s.inverse;
        const Floats start = (step_.middle + line0) * by_line, off = (step_.middle + line0) * off_line;
        fragments_.room(kPixels + kLanes<float>);
        for (Words left = reached & (rows ? open_.rows : open_.columns); any<float>((Mask<float>)left != 0); left &= left - 1) {
            // The first pixel of each line, by the exponent of its bit
            const Mask<float> bit = (Mask<float>)(left & -left);
            const Mask<float> first = bit == 0 ? bit : ((Mask<float>)__builtin_convertvector(bit, Floats) >> 23) - 127;
            const Mask<float> p = rows ? step_.line * kTile + first : first * kTile + step_.line;
            const Floats at = __builtin_convertvector(first, Floats) + (0.5f + first0), along = (start + at * by_first) * s.inverse;
            const Floats t = minimum<float>(maximum<float>(along, splat(0.0f)), splat(1.0f)), d = s.d() + s.dd() * t;
            Mask<float> some = bit != 0, special = (along < end) | (along > 1 - end);
            if (behind) some &= d <= gather_floats(farthest_, p);
            if (beside) special |= d > gather_floats(nearest_, p);
            deepest_ = select<float>(some, maximum<float>(deepest_, d), deepest_);
            const Mask<float> tagged = (special & int32_t(kSpecial)) | int32_t(number);
            fragments_.add(some, p, d, tagged, t, off + at * off_first, Band(s.h + t * s.dh));
        }
    }

    RINGLET_INLINE Crossing crossing(const Segment &s, uint32_t p) const { return Crossing(s, x_[p % kTile], y_[p / kTile]); }

    /// Puts a fragment into its pixel's window; the number + 1 of the nearest that the window has no room for, or 0.
    RINGLET_INLINE uint32_t hold(int32_t p, int64_t next) {
        const Held every = Held{} + next, held = window_[p], later = every > held ? every : held;
        const Held after = {held[1], INT64_MAX};
        window_[p] = later < after ? later : after;
        return uint32_t((every < held ? every : held)[0]);
    }

    RINGLET_INLINE void composite(const Segment *segments, uint32_t k) {
        const uint32_t p = uint32_t(fragments_.pixel[k]);
        if (!is_open(p)) return;
        const uint32_t number = uint32_t(fragments_.segment[k]) & ~kSpecial;
        const Segment &s = segments[number];
        const Shown shown = s.shown + fragments_.t[k] * s.gain;
        Cells part = across(s, fragments_.off[k], fragments_.band(k), centres_);
        if (fragments_.segment[k] < 0) {
            part *= along(s, crossing(s, p), centres_);
            if (shown[3] > nearest_[p]) part = in_front(part, shown[3], left_ + int(p % kTile), top_ + int(p / kTile));
        }
        Cells taken = T_[p] * part;
        if (sides_ && shows_sides(s)) shown_[p] += aside(s, crossing(s, p), centres_, T_[p], part, taken, gaps_[p], sides_->ends(number));
        T_[p] -= taken;
        const float weight = sum_cells(taken) * (1.0f / (kCells * kCells));
        note(p, shown[3], weight);
        shown_[p] += weight * shown;
        clear_[p] -= weight;
        if (names_ && weight > most_[p].part) most_[p] = {weight, number};
    }

    /// Notes that a fragment of this depth takes `weight` of pixel p: where it should have come before, it is wrong by what
    /// it would have taken of that which is gone.
    RINGLET_INLINE void note(uint32_t p, float depth, float weight) {
        const float missed = weight * ((1 - clear_[p]) / clear_[p]);
        mixed_[p] += missed * (depth + before_ < last_[p] ? 1.0f : 0.0f);
        last_[p] += std::min(weight * (1 / kLast), 1.0f) * (depth - last_[p]);
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
