// The tiles of a block, one after another: the block's segments sorted into them, shaded where they are seen, drawn.
#pragma once

#include "depth_order.hpp"
#include "segment_lanes.hpp"
#include "strand_point.hpp"
#include "tiles.hpp"

namespace ringlet {

/// What is drawn into.
struct Pictures {
    float *colour;   // (H, W, 3)
    uint32_t *names; // (H, W) key of the strand that takes most of a pixel, 0 where there is none; or null
};

class Painter {
  public:
    size_t shaded = 0; // points

    /// `solid` is the farthest depth of the backdrop in each tile.
    Painter(const View &view, const std::vector<float> &solid, Bins &bins) : view_(view), solid_(solid), bins_(bins), tile_(view) {}

    /// Starts a picture.
    void begin(const Backdrop &back, const PointShader &shader, const Pictures &pictures) {
        shaded = 0, shader_ = &shader, pictures_ = pictures;
        sides_.clear();
        tile_.over(back, pictures.names);
    }

    /// Draws the wrong tiles of a block, and sets what is wrong with them now; how many of them still are.
    int block(int block, const uint32_t *number, size_t count, uint8_t *wrong, TilePixels *lacking) {
        sort_into_tiles(block, number, count, wrong);
        int still = 0;
        for (int tile = block * kCount; tile < (block + 1) * kCount; ++tile) {
            if (!wrong[tile]) continue;
            const TilePixels wanted = bins_.wanted.empty() ? TilePixels::all() : bins_.wanted[tile];
            const std::span<const uint64_t> entries = entries_.of(tile - block * kCount);
            if (entries.empty() && bins_.cut[tile] >= solid_[tile] && !pictures_.names) {
                tile_.bare(tile, wanted, pictures_.colour);
                lacking[tile] = TilePixels::none(), wrong[tile] = 0;
                continue;
            }
            lacking[tile] = paint(tile, wanted, entries);
            const TilePixels mixed = tile_.mixed().without(lacking[tile]);
            if (mixed.some()) lacking[tile] = lacking[tile] | paint_again(tile, mixed, entries);
            wrong[tile] = lacking[tile].some();
            still += wrong[tile];
        }
        return still;
    }

  private:
    static constexpr int kCount = kSide * kSide, kAhead = 32;
    static constexpr size_t kPortion = 128; // entries that are shaded together
    static constexpr size_t kLook = 32;     // entries from one look at which pixels are open to the next

    const View &view_;
    const std::vector<float> &solid_;
    Bins &bins_;
    const PointShader *shader_ = nullptr;
    Pictures pictures_{};
    Tile tile_;
    DepthOrder order_;
    std::vector<Segment> segments_; // of the block
    std::vector<uint32_t> number_;  // of each of them
    std::vector<uint8_t> shaded_;   // whether it has its colours
    TileEntries entries_;
    std::vector<uint64_t> again_, near_; // entries of mixed pixels, and of a square of them
    std::vector<uint32_t> uncoloured_; // segments that wait for the colours of their points
    std::vector<uint32_t> unshaded_;   // points
    Sides sides_;
    std::vector<StrandPoint> to_shade_;
    std::vector<float> radiance_;
    Words reached_[kPortion]; // pixels of each entry
    uint32_t drawn_[kPortion]; // its segment

    /// The key of the strand of segment i of the block.
    uint32_t key(int i) const {
        const uint32_t point = bins_.seen(number_[i])->number & ~SeenPoint::kKnown;
        return bins_.batch(number_[i]).key[point / uint32_t(bins_.P)];
    }

    void sort_into_tiles(int block, const uint32_t *number, size_t count, const uint8_t *wrong) {
        constexpr size_t step = SegmentLanes::kCount;
        const float left = float(view_.left(block * kCount)), top = float(view_.top(block * kCount));
        TileLanes cut;
        std::memcpy(&cut, &bins_.cut[size_t(block) * kCount], sizeof cut);
        uint32_t waiting = 0;
        for (int k = 0; k < kCount; ++k) waiting |= uint32_t(wrong[block * kCount + k] != 0) << k;
        entries_.clear();
        segments_.resize((count + step - 1) / step * step), number_.assign(number, number + count), shaded_.assign(count, 0);
        sides_.begin(), tile_.with(nullptr);
        for (size_t first = 0; first < count; first += step) {
            const ScreenPoint *begin[step];
            Mask<float> some;
            for (size_t i = 0; i < step; ++i) {
                begin[i] = bins_.at(number[std::min(first + i, count - 1)]), some[i] = first + i < count ? -1 : 0;
                if (first + i + kAhead < count) fetch(bins_.at(number[first + i + kAhead]));
            }
            const SegmentLanes lanes(begin);
            lanes.write(&segments_[first]);
            entries_.add(lanes, some, uint32_t(first), left, top, cut, waiting);
        }
    }

    /// Draws pixels of a tile; those that may lack hair from behind the cut-off.
    TilePixels paint(int tile, const TilePixels &wanted, std::span<const uint64_t> entries) {
        tile_.begin(tile, wanted);
        return paint(tile, entries);
    }

    /// The same of a tile that has begun.
    TilePixels paint(int tile, std::span<const uint64_t> entries) {
        order_.begin(entries);
        if (!entries.empty()) tile_.around(segments_[uint32_t(*order_.sorted(1)) - 1].d());
        const TilePixels lacking = draw(bins_.cut[tile]);
        tile_.write(pictures_.colour);
        if (pictures_.names) tile_.name([&](int x, int y, int k) { pictures_.names[size_t(y) * view_.W + x] = k < 0 ? 0 : key(k); });
        return lacking;
    }

    /// Draws mixed pixels in the order of depth in the middle of smaller squares. What closed them closes them again, so
    /// that what is all behind it stays away.
    TilePixels paint_again(int tile, const TilePixels &mixed, std::span<const uint64_t> entries) {
        const float deepest = tile_.deepest();
        tile_.begin(tile, mixed);
        again_.clear();
        for (const uint64_t entry : entries) {
            const Segment &s = segments_[uint32_t(entry) - 1];
            if (std::min(s.d(), s.d() + s.dd()) <= deepest && any<float>((Mask<float>)tile_.reached(s) != 0)) again_.push_back(entry);
        }
        TilePixels lacking = TilePixels::none();
        for (int y = 0; y < kTile; y += Tile::kSquare)
            for (int x = 0; x < kTile; x += Tile::kSquare) {
                const TilePixels own = mixed & TilePixels::square(x, y, Tile::kSquare);
                if (!own.some()) continue;
                tile_.begin(tile, own);
                near_.clear();
                for (const uint64_t entry : again_) {
                    const Segment &s = segments_[uint32_t(entry) - 1];
                    if (any<float>((Mask<float>)tile_.reached(s) != 0)) near_.push_back(fragment(tile_.depth(s, x, y, Tile::kSquare), uint32_t(entry) - 1));
                }
                lacking = lacking | paint(tile, near_);
            }
        return lacking;
    }

    /// Draws the entries of a tile; the pixels that may lack hair from behind the cut-off.
    TilePixels draw(float cut) {
        // What was left out lies behind the cut-off: only what happens before it is certain
        const uint64_t certain = fragment(cut, UINT32_MAX - 1);
        TilePixels lacking = TilePixels::none();
        bool passed = false;
        for (size_t k = 0; k < order_.size() && !tile_.closed(); k += kPortion) {
            const size_t end = std::min(k + kPortion, order_.size()), count = end - k;
            const uint64_t *entry = order_.sorted(end) + k;
            for (size_t i = 0; i < count; ++i) {
                if (i + kAhead < count) __builtin_prefetch(&segments_[uint32_t(entry[i + kAhead]) - 1]);
                drawn_[i] = uint32_t(entry[i]) - 1;
                reached_[i] = tile_.reached(segments_[drawn_[i]]);
                if (any<float>((Mask<float>)reached_[i] != 0)) want(drawn_[i]);
            }
            shade();
            for (size_t i = 0; i < count && !tile_.closed(); tile_.find_open()) {
                for (const size_t last = std::min(i + kLook, count); i < last; ++i) {
                    if (!passed && entry[i] > certain) {
                        tile_.draw(segments_.data());
                        lacking = tile_.open_beyond(cut), passed = true;
                    }
                    tile_.add(segments_.data(), drawn_[i], reached_[i]);
                }
                tile_.draw(segments_.data());
            }
        }
        if (!passed) lacking = tile_.open_beyond(cut);
        tile_.finish(segments_.data());
        return lacking;
    }

    /// Brings both ends of a segment near, which may lie in two lines of the cache.
    template <class Point> static void fetch(const Point *ends) { __builtin_prefetch(&ends[0]), __builtin_prefetch(&ends[1]); }

    /// Notes that segment i of the block needs its colours.
    void want(uint32_t i) {
        if (shaded_[i]) return;
        shaded_[i] = 1;
        fetch(bins_.seen(number_[i]));
        uncoloured_.push_back(i);
    }

    /// Shades the points that are wanted, and colours the segments. Another thread may shade the same point beside this
    /// one, to the same bits.
    void shade() {
        shade_wide();
        for (const uint32_t i : uncoloured_)
            for (uint32_t point = number_[i]; point < number_[i] + 2; ++point)
                if (!(known(point) & SeenPoint::kKnown)) unshaded_.push_back(point);
        find_unshaded();
        radiance_.resize(3 * to_shade_.size());
        shader_->shade(to_shade_.data(), to_shade_.size(), bins_.P, radiance_.data());
        for (size_t i = 0; i < unshaded_.size(); ++i) {
            SeenPoint &to = *bins_.seen(unshaded_[i]);
            for (int c = 0; c < 3; ++c) __atomic_store(&to.colour[c], &radiance_[3 * i + c], __ATOMIC_RELAXED);
            __atomic_store_n(&to.number, known(unshaded_[i]) | SeenPoint::kKnown, __ATOMIC_RELEASE); // all write the same
        }
        for (const uint32_t i : uncoloured_) {
            const SeenPoint *ends = bins_.seen(number_[i]);
            for (int c = 0; c < 3; ++c) {
                segments_[i].shown[c] = ends[0].colour[c];
                segments_[i].gain[c] = ends[1].colour[c] - ends[0].colour[c];
            }
        }
        unshaded_.clear(), uncoloured_.clear();
    }

    /// The same of wide segments, which no longer wait then. Their colours are this painter's alone.
    void shade_wide() {
        if (!shader_->varies_across()) return;
        const auto thin = [&](uint32_t i) { return !shows_sides(segments_[i]); };
        const auto wide = std::partition(uncoloured_.begin(), uncoloured_.end(), thin);
        if (wide == uncoloured_.end()) return;
        for (auto i = wide; i != uncoloured_.end(); ++i)
            for (uint32_t point = number_[*i]; point < number_[*i] + 2; ++point)
                if (!sides_.has(point)) unshaded_.push_back(point);
        find_unshaded();
        shader_->shade_across(to_shade_.data(), to_shade_.size(), bins_.P, sides_.add(unshaded_));
        for (auto i = wide; i != uncoloured_.end(); ++i) {
            Segment &s = segments_[*i];
            const auto [begin, end] = sides_.join(*i, number_[*i]);
            for (int c = 0; c < 3; ++c) s.shown[c] = begin->mean[c], s.gain[c] = end->mean[c] - begin->mean[c];
        }
        tile_.with(&sides_);
        unshaded_.clear(), uncoloured_.erase(wide, uncoloured_.end());
    }

    /// Finds the points that are not shaded yet, each once.
    void find_unshaded() {
        std::sort(unshaded_.begin(), unshaded_.end());
        unshaded_.erase(std::unique(unshaded_.begin(), unshaded_.end()), unshaded_.end());
        to_shade_.clear();
        for (const uint32_t number : unshaded_) {
            const Batch &batch = bins_.batch(number);
            const uint32_t point = bins_.seen(number)->number & ~SeenPoint::kKnown, strand = point / uint32_t(bins_.P);
            to_shade_.push_back({batch.points.data + size_t(strand) * bins_.P * 3, batch.variation.data + 3 * size_t(strand),
                                 batch.key[strand], int(point - strand * uint32_t(bins_.P))});
            __builtin_prefetch(batch.points.data + 3 * size_t(point)), __builtin_prefetch(to_shade_.back().root);
        }
        shaded += to_shade_.size();
    }

    uint32_t known(uint32_t point) const { return __atomic_load_n(&bins_.seen(point)->number, __ATOMIC_ACQUIRE); }
};

} // namespace ringlet
