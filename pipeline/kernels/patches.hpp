// Which strands share a block: neighbours on the skin, which follow the same guides and are near the head together.
//
// A file's strands are in progressive order: sixteen that follow one another there come from all over the head, read
// sixteen places of every table, and hardly ever is none of them near the skin. Within tiles of kTile strands they
// are taken along a curve that fills space (Morton, "A Computer Oriented Geodetic Data Base", 1966). What a strand
// becomes does not depend on the strands beside it, so that the order is seen by the clock only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

inline constexpr int kTile = 16384;

/// The ten low bits of a number with two zeros after each.
inline uint32_t spread_bits(uint32_t a) {
    a = (a | a << 16) & 0x030000FFu;
    a = (a | a << 8) & 0x0300F00Fu;
    a = (a | a << 4) & 0x030C30C3u;
    return (a | a << 2) & 0x09249249u;
}

/// Order of N strands with roots (N, 3): place in its tile of the strand to take next, for every tile.
inline std::vector<uint16_t> in_patches(const float *root, size_t N, int threads) {
    float low[3] = {}, high[3] = {};
    for (int axis = 0; axis < 3; ++axis)
        for (size_t i = 0; i < N; ++i) {
            const float x = root[3 * i + axis];
            low[axis] = i ? std::min(low[axis], x) : x, high[axis] = i ? std::max(high[axis], x) : x;
        }
    const float widest = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-6f});
    std::vector<uint16_t> order(N);
    const int tiles = int((N + kTile - 1) / kTile);
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (int tile = 0; tile < tiles; ++tile) {
        const size_t begin = size_t(tile) * kTile, count = std::min<size_t>(kTile, N - begin);
        std::vector<uint64_t> sorted(count); // code, then place
        for (size_t i = 0; i < count; ++i) {
            uint64_t code = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const float at = (root[3 * (begin + i) + axis] - low[axis]) / widest * 1023;
                code |= spread_bits(uint32_t(at > 0 ? std::min(at, 1023.0f) : 0.0f)) << axis;
            }
            sorted[i] = code << 16 | i;
        }
        std::sort(sorted.begin(), sorted.end());
        for (size_t i = 0; i < count; ++i) order[begin + i] = uint16_t(sorted[i]);
    }
    return order;
}

/// The strands begin .. begin + count in that order.
inline std::vector<int> taken_in_patches(const std::vector<uint16_t> &order, size_t begin, size_t count) {
    std::vector<int> taken;
    taken.reserve(count);
    for (size_t tile = begin / kTile * kTile; tile < begin + count; tile += kTile)
        for (size_t i = tile; i < std::min(tile + kTile, order.size()); ++i) {
            const size_t strand = tile + order[i];
            if (strand >= begin && strand < begin + count) taken.push_back(int(strand));
        }
    return taken;
}

} // namespace ringlet
