// 16 segments on the screen side by side, a lane for each, and the tiles of a block that they touch.
//
// A segment touches a tile as `Touch` says it; what depends on the tile's column alone, or on its row, is told for four
// columns and four rows instead of 16 tiles.
#pragma once

#include "blocks.hpp"

#include <span>
#include <utility>

namespace ringlet {

/// Swaps rows and columns of two 8 x 8 blocks: row j of the first lies in the lower halves, of the second in the upper ones.
RINGLET_INLINE void transpose_halves(Floats rows[8]) {
    const auto exchange = [&]<int kStep, int... kLane>(std::integral_constant<int, kStep>, std::integer_sequence<int, kLane...>) RINGLET_ALWAYS {
        for (int i = 0; i < 8; ++i) {
            if (i & kStep) continue;
            const Floats a = rows[i], b = rows[i | kStep];
            rows[i] = __builtin_shufflevector(a, b, (kLane & kStep ? 16 + kLane - kStep : kLane)...);
            rows[i | kStep] = __builtin_shufflevector(a, b, (kLane & kStep ? 16 + kLane : kLane + kStep)...);
        }
    };
    const auto lanes = std::make_integer_sequence<int, 16>();
    exchange(std::integral_constant<int, 1>(), lanes);
    exchange(std::integral_constant<int, 2>(), lanes);
    exchange(std::integral_constant<int, 4>(), lanes);
}

/// 16 segments; see `Segment`.
struct SegmentLanes {
    static constexpr int kCount = kLanes<float>;

    Floats x, y, dx, dy, ux, uy, inverse, h, dh, d, dd;
    Mask<float> ends;

    /// Of the points at which they begin; those at which they end follow them.
    explicit RINGLET_INLINE SegmentLanes(const ScreenPoint *const begin[kCount]) {
        static_assert(sizeof(ScreenPoint) == 4 * sizeof(float));
        float rows[kCount][8];
        for (int i = 0; i < kCount; ++i) std::memcpy(rows[2 * (i % 8) + i / 8], begin[i], sizeof rows[0]);
        Floats value[8];
        std::memcpy(value, rows, sizeof value);
        transpose_halves(value);
        x = value[0], y = value[1], d = value[2], h = magnitude(value[3]);
        dx = value[4] - x, dy = value[5] - y, dd = value[6] - d, dh = magnitude(value[7]) - h;
        ends = ((value[3] < 0) & int(kFirst)) | ((value[7] < 0) & int(kLast));
        inverse = 1 / square_root<float>(dx * dx + dy * dy);
        ux = dx * inverse, uy = dy * inverse;
    }

    /// Writes all of them, without colours.
    RINGLET_INLINE void write(Segment *to) const {
        Floats value[8] = {x, y, ux, uy, inverse, Floats(ends), h, dh};
        transpose_halves(value);
        float rows[kCount][8], depth[kCount], gain[kCount];
        std::memcpy(rows, value, sizeof rows), std::memcpy(depth, &d, sizeof d), std::memcpy(gain, &dd, sizeof dd);
        for (int i = 0; i < kCount; ++i) {
            std::memcpy(static_cast<void *>(to + i), rows[2 * (i % 8) + i / 8], sizeof rows[0]);
            to[i].shown = Shown{0, 0, 0, depth[i]}, to[i].gain = Shown{0, 0, 0, gain[i]};
        }
    }
};

/// What touches each tile of a block: depth at the point nearest its middle, and the segment's number; see `fragment`.
class TileEntries {
  public:
    static constexpr int kCount = kSide * kSide;

    void clear() { std::fill(size_, size_ + kCount, 0); }

    std::span<const uint64_t> of(int k) const { return {entries_[k].data(), size_[k]}; }

    /// Enters those of segments `first` and following that are set, in the block with its corner at (left, top) [px]: in tiles
    /// that wait, unless they lie behind the tile's cut-off.
    RINGLET_INLINE void add(const SegmentLanes &s, Mask<float> some, uint32_t first, float left, float top, const TileLanes &cut, uint32_t waiting) {
        const Floats wider = maximum<float>(s.h, s.h + s.dh) + kReach, far = kTile * 0.5f + wider;
        const Floats wide = kTile * 0.5f * (magnitude(s.ux) + magnitude(s.uy)) + wider;
        const Floats far_x = far + 0.5f * magnitude(s.dx), far_y = far + 0.5f * magnitude(s.dy);
        const Floats spread = magnitude(s.dd) * s.inverse * (0.75f * kTile), least = minimum<float>(s.d, s.d + s.dd);
        Floats across_x[kSide], across_y[kSide], along_x[kSide], along_y[kSide];
        Mask<float> in_x[kSide], in_y[kSide];
        for (int k = 0; k < kSide; ++k) {
            const float middle = (k + 0.5f) * kTile;
            const Floats x = middle + left - s.x, y = middle + top - s.y;
            in_x[k] = some & (magnitude(x - 0.5f * s.dx) <= far_x), in_y[k] = magnitude(y - 0.5f * s.dy) <= far_y;
            across_x[k] = x * s.uy, across_y[k] = y * s.ux;
            along_x[k] = x * s.ux, along_y[k] = y * s.uy;
        }
        const Mask<float> number = Mask<float>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} + int32_t(first + 1);
        for (; waiting; waiting &= waiting - 1) {
            const int k = __builtin_ctz(waiting), row = k / kSide, column = k % kSide;
            const Floats t = (along_x[column] + along_y[row]) * s.inverse;
            const Floats depth = s.d + s.dd * minimum<float>(maximum<float>(t, splat(0.0f)), splat(1.0f));
            const Floats nearest = maximum<float>(depth - spread, least);
            const Mask<float> touched = in_x[column] & in_y[row] & (magnitude(across_x[column] - across_y[row]) <= wide) & (nearest <= cut[k]);
            if (entries_[k].size() < size_[k] + SegmentLanes::kCount) entries_[k].resize(2 * size_[k] + 256);
            size_[k] += size_t(write_chosen_pairs(touched, number, (Mask<float>)depth, &entries_[k][size_[k]]));
        }
    }

  private:
    std::vector<uint64_t> entries_[kCount];
    size_t size_[kCount] = {};
};

} // namespace ringlet
