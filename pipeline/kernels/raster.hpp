// Strands thinner than pixels, drawn by coverage instead of samples and merged with a picture of everything else by depth.
//
// Passes over all strands, in chunks of any size: (1) some of them tell how deep hair is seen (layers.hpp); (2) segments
// before that depth are sorted into blocks of tiles (bins.hpp); (3) tiles are composited front to back (tiles.hpp), and
// points are shaded when a segment of theirs comes to an open pixel (painter.hpp). Pixels that were cut off too early say
// so, and are drawn again with nothing cut off: the picture is the one of all strands. Nothing depends on chunks or
// threads: counts are integers, and equal depths are in the order of strands. Ours; coverage in the spirit of Carpenter,
// "The A-buffer, an Antialiased Hidden Surface Method" (1984).
#pragma once

#include "layers.hpp"
#include "painter.hpp"

#include <memory>

#include <omp.h>

namespace ringlet {

class Raster {
  public:
    View view;
    float layers; // of hair behind which nothing is seen
    Layers counted;
    Bins bins;
    std::vector<float> solid; // the farthest depth of the backdrop in each tile
    size_t shaded = 0; // points of the picture; a few of them twice, where threads meet
    std::vector<uint8_t> wrong; // tiles that are not drawn yet, or have pixels that were cut off too early

    Raster(int W, int H, float layers) : view{{}, W, H, 0, 0, 0}, layers(layers) {}

    /// Starts a picture of the same size.
    void begin(const View &seen) {
        view = seen;
        shaded = 0;
        counted.clear(), bins.cut.clear(), bins.wanted.clear(), bins.clear();
    }

    /// Cuts off behind `layers` of hair, and behind the backdrop.
    void cut_off(const Backdrop &back, int threads) {
        bins.cut = counted.depths(view, layers, threads);
        counted.clear();
        solid = deepest(back, threads);
        for (int tile = 0; tile < view.tiles(); ++tile) bins.cut[tile] = std::min(bins.cut[tile], solid[tile]);
        wrong.assign(view.tiles(), 1);
        bins.wanted.clear();
    }

    /// Draws the tiles that are wrong, linear RGB; how many of them still are. For those, strands are to be added once
    /// more.
    int compose(const Backdrop &back, const PointShader &shader, const Pictures &pictures, int threads) {
        std::vector<TilePixels> lacking(view.tiles(), TilePixels::none());
        std::vector<size_t> begin;
        sort_by_block(begin, threads);
        while (int(painters_.size()) < threads) painters_.push_back(std::make_unique<Painter>(view, solid, bins));
        int count = 0;
        size_t points = 0;
#pragma omp parallel num_threads(threads) reduction(+ : count, points)
        {
            Painter &painter = *painters_[size_t(omp_get_thread_num())];
            painter.begin(back, shader, pictures);
#pragma omp for schedule(dynamic, 1)
            for (int block = 0; block < view.across() * view.down(); ++block)
                count += painter.block(block, segments_.data() + begin[block], begin[block + 1] - begin[block], wrong.data(),
                                       lacking.data());
            points = painter.shaded;
        }
        shaded += points;
        bins.clear();
        if (count) only(std::move(lacking));
        return count;
    }

  private:
    // Both stay from picture to picture, for memory that is new costs time
    std::vector<std::unique_ptr<Painter>> painters_; // of each thread
    std::vector<uint32_t> segments_;                 // in the order of strands, block after block

    /// From now on only these pixels are wanted, and nothing before the backdrop is cut off.
    void only(std::vector<TilePixels> pixels) {
        for (int tile = 0; tile < view.tiles(); ++tile) bins.cut[tile] = wrong[tile] ? solid[tile] : -1;
        bins.wanted = std::move(pixels);
    }

    /// The farthest depth of the backdrop in each tile; -1 outside the picture.
    std::vector<float> deepest(const Backdrop &back, int threads) const {
        std::vector<float> depth(view.tiles(), -1);
        const int side = kTile * back.n, across = view.W * back.n, down = view.H * back.n;
#pragma omp parallel for schedule(static) num_threads(threads)
        for (int top = 0; top < down; top += side)
            for (int left = 0; left < across; left += side) {
                Floats most = splat(-1.0f);
                for (int y = top; y < std::min(top + side, down); ++y) {
                    const float *row = back.depth + size_t(y) * across;
                    int x = left;
                    for (; x + 16 <= std::min(left + side, across); x += 16) {
                        Floats here;
                        std::memcpy(&here, row + x, sizeof here);
                        most = maximum<float>(most, here);
                    }
                    for (; x < std::min(left + side, across); ++x) most[0] = std::max(most[0], row[x]);
                }
                depth[view.tile(left / side, top / side)] = largest<float>(most);
            }
        return depth;
    }

    /// Sorts the segments by blocks: a counting sort, with counters for each thread. `begin` says where each block's are.
    void sort_by_block(std::vector<size_t> &begin, int threads) {
        const size_t blocks = size_t(view.across()) * view.down(), batches = bins.batches.size();
        std::vector<std::vector<size_t>> next(threads, std::vector<size_t>(blocks));
        const auto share = [&](int thread) { return batches * thread / threads; };
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t b = share(thread); b < share(thread + 1); ++b)
                for (const Entry &entry : bins.batches[b].entries) ++next[thread][entry.block];
        begin.assign(blocks + 1, 0);
        size_t total = 0;
        for (size_t block = 0; block < blocks; ++block) {
            begin[block] = total;
            for (auto &mine : next) {
                const size_t count = mine[block];
                mine[block] = total, total += count;
            }
        }
        begin[blocks] = total;
        if (segments_.size() < total) segments_.resize(total);
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t b = share(thread); b < share(thread + 1); ++b) {
                for (const Entry &entry : bins.batches[b].entries) segments_[next[thread][entry.block]++] = entry.segment;
                bins.batches[b].entries = {};
            }
    }
};

} // namespace ringlet
