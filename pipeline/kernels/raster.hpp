// Strands thinner than pixels, drawn by coverage instead of samples and merged with a picture of everything else by depth.
//
// Passes over all strands, in chunks of any size: (1) some of them tell how deep hair is seen (layers.hpp); (2) segments
// before that depth are sorted into tiles (bins.hpp), and only their points need colours; (3) tiles are composited front
// to back (tiles.hpp). Pixels that were cut off too early say so, and are drawn again with nothing cut off: the picture is
// the one of all strands. Nothing depends on chunks or threads: counts are integers, and equal depths are in the order
// of strands. Ours; coverage in the spirit of Carpenter, "The A-buffer, an Antialiased Hidden Surface Method" (1984).
#pragma once

#include "layers.hpp"
#include "tiles.hpp"

#include <memory>

namespace ringlet {

class Raster {
  public:
    View view;
    float layers; // of hair behind which nothing is seen
    Layers counted;
    Bins bins;
    std::vector<uint8_t> wrong; // tiles that are not drawn yet, or have pixels that were cut off too early

    /// Cuts off behind `layers` of hair, and behind the backdrop.
    void cut_off(const Backdrop &back, int threads) {
        bins.cut = counted.depths(view, layers, threads);
        counted.counts.clear();
        const std::vector<float> solid = deepest(back, threads);
        for (int tile = 0; tile < view.tiles(); ++tile) bins.cut[tile] = std::min(bins.cut[tile], solid[tile]);
        wrong.assign(view.tiles(), 1);
        bins.wanted.clear();
    }

    /// Draws the tiles that are wrong into a picture (H, W, 3), linear RGB; how many of them still are. For those,
    /// strands are to be added once more.
    int compose(const Backdrop &back, float *picture, int threads) {
        std::vector<TilePixels> lacking(view.tiles());
        std::vector<size_t> begin;
        const std::vector<uint64_t> entries = sorted_by_tile(begin, threads);
        int count = 0;
#pragma omp parallel num_threads(threads) reduction(+ : count)
        {
            auto tile = std::make_unique<Tile>();
            std::vector<uint64_t> mine;
#pragma omp for schedule(dynamic, 4)
            for (int k = 0; k < view.tiles(); ++k) {
                if (!wrong[k]) continue;
                mine.assign(entries.begin() + ptrdiff_t(begin[k]), entries.begin() + ptrdiff_t(begin[k + 1]));
                std::sort(mine.begin(), mine.end());
                lacking[k] = tile->draw(view, bins, mine.data(), mine.size(), back, k,
                                        bins.wanted.empty() ? TilePixels::all() : bins.wanted[k]);
                tile->write(view, back, k, picture);
                wrong[k] = std::any_of(lacking[k].row, lacking[k].row + kTile, [](uint32_t row) { return row != 0; });
                count += wrong[k];
            }
        }
        bins.batches.clear();
        bins.waiting = 0;
        if (count) only(std::move(lacking), back, threads);
        return count;
    }

  private:
    /// From now on only these pixels are wanted, and nothing before the backdrop is cut off.
    void only(std::vector<TilePixels> pixels, const Backdrop &back, int threads) {
        const std::vector<float> solid = deepest(back, threads);
        for (int tile = 0; tile < view.tiles(); ++tile) bins.cut[tile] = wrong[tile] ? solid[tile] : -1;
        bins.wanted = std::move(pixels);
    }

    std::vector<float> deepest(const Backdrop &back, int threads) const {
        std::vector<float> depth(view.tiles(), 0);
        const int side = kTile * back.n;
#pragma omp parallel for schedule(static) num_threads(threads)
        for (int row = 0; row < view.down(); ++row)
            for (int y = row * side; y < std::min((row + 1) * side, view.H * back.n); ++y)
                for (int x = 0; x < view.W * back.n; ++x) {
                    float &at = depth[size_t(row) * view.across() + x / side];
                    at = std::max(at, back.depth[size_t(y) * view.W * back.n + x]);
                }
        return depth;
    }

    /// Entries as depth << 32 | segment, tile after tile: a counting sort, with counters for each thread.
    std::vector<uint64_t> sorted_by_tile(std::vector<size_t> &begin, int threads) {
        const size_t tiles = view.tiles(), batches = bins.batches.size();
        std::vector<std::vector<size_t>> next(threads, std::vector<size_t>(tiles));
        const auto share = [&](int thread) { return batches * thread / threads; };
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t b = share(thread); b < share(thread + 1); ++b)
                for (const Entry &entry : bins.batches[b].entries) ++next[thread][entry.tile];
        begin.assign(tiles + 1, 0);
        size_t total = 0;
        for (size_t tile = 0; tile < tiles; ++tile) {
            begin[tile] = total;
            for (auto &mine : next) {
                const size_t count = mine[tile];
                mine[tile] = total, total += count;
            }
        }
        begin[tiles] = total;
        std::vector<uint64_t> entries(total);
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t b = share(thread); b < share(thread + 1); ++b) {
                for (const Entry &entry : bins.batches[b].entries)
                    entries[next[thread][entry.tile]++] = uint64_t(entry.depth) << 32 | entry.segment;
                bins.batches[b].entries = {};
            }
        return entries;
    }
};

} // namespace ringlet
