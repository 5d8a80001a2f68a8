// Colours across strands that are wide enough on the screen to show them, and what cells of pixels see of them.
//
// A fibre is brighter along its middle, or along one side, than in the mean. h runs from -1 to 1 across it, positive to the
// right of who goes from root to tip as the eye sees it. K places lie (2 k + 1) / K - 1 across, and colours are linear from one
// to the next, beyond the last the same: the mean over the strand is that of the K. A cell of a pixel sees the mean over that
// part of the strand which lies in it: of a strand thinner than a cell the colour that it has from afar.
//
// Where strands before it have left a gap of a cell open, the cell sees what lies in the gap. Each cell keeps its gap's middle;
// T is the part of it that is open. A middle that lies as far from the cell's, across the strand, as it can is that of a gap
// along the strand, as wide as T says: such a strand takes what it covers of the gap. Where the middle does not tell, it takes
// its part of T by chance, as thin strands do, which leave the middle where it is.
// `test_packed_strands_show_in_each_column_what_a_picture_eight_times_as_fine_does`
//
// Of what differs from the mean, strands show nothing at kThin px of width and all from kWide on. Packed fibres show their
// crowns oftener (`shown` of shade.hpp): from there on the picture tells that, not the statistics.
#pragma once

#include "coverage.hpp"
#include "elementary.hpp"
#include "strand_point.hpp"

#include <array>
#include <unordered_map>
#include <vector>

namespace ringlet {

constexpr float kThin = 0.26f, kWide = 0.4f; // [px]

/// Whether a segment is wide enough all along.
RINGLET_INLINE bool shows_sides(const Segment &s) { return std::min(s.h, s.h + s.dh) > 0.5f * kThin; }

/// Integral of what one channel has at places, up to x (in steps from place to place, from the first one on).
struct Integral {
    Cells aside, gain, sum;

    Integral(Cells aside, Cells sum)
        : aside(aside), gain(__builtin_shufflevector(aside, aside, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 15) - aside), sum(sum) {}

    RINGLET_INLINE Cells operator()(Cells x, Mask<float> place) const {
        const Cells u = x - __builtin_convertvector(place, Cells);
        return pick(sum, place) + u * (pick(aside, place) + 0.5f * pick(gain, place) * maximum<float>(u, splat(0.0f)));
    }
};

/// The place before x; of what lies before the first or after the last, that one.
RINGLET_INLINE Mask<float> place(Cells x) { return __builtin_convertvector(clamp_cells(x, 0, Across::kPlaces - 1), Mask<float>); }

/// Where cells of a pixel are still open: the middle of what is, from the cell's centre [px].
struct Gaps {
    Cells x, y;
};

/// Sets what a segment takes of cells of which T is open and which it covers in `part`; by how much that differs from as much
/// of its mean colour, where `ends` are the colours of both of its points.
__attribute__((noinline)) inline Shown aside(const Segment &s, const Crossing &at, const CellCentres &cell, Cells T, Cells part,
                                             Cells &taken, Gaps &gaps, const std::array<const Across *, 2> &ends) {
    constexpr float side = 1.0f / kCells, least = 1e-3f;
    const float half = s.h + at.t * s.dh, scale = 0.5f * Across::kPlaces / half;
    const float much = std::min((2 * half - kThin) * (1 / (kWide - kThin)), 1.0f);
    const Cells v = at.across + s.ux * cell.y - s.uy * cell.x, gap = s.ux * gaps.y - s.uy * gaps.x, none = splat(0.0f);
    // The part of the segment in each cell
    const Cells from = maximum<float>(v - 0.5f * side, splat(-half)), to = minimum<float>(v + 0.5f * side, splat(half));
    const Cells inside = maximum<float>(to - from, splat(least * side));
    // A gap that lies as far aside as it can has been left by strands that go as this one does
    const Cells room = 0.5f * side * (1 - T), along = minimum<float>((magnitude(gap) + least) / (room + least), splat(1.0f));
    const Cells meets = minimum<float>(to, v + gap + 0.5f * side * T) - maximum<float>(from, v + gap - 0.5f * side * T);
    taken = part * (T + much * along * (maximum<float>(meets, none) / inside - T));
    // What is seen of it lies nearest the gap and is as wide, and what is left lies farther from there
    const Cells wide = minimum<float>(side * (1 - along * (1 - T)) + least * side, inside);
    const Cells low = maximum<float>(minimum<float>(v + gap - 0.5f * wide, to - wide), from);
    const Cells left = maximum<float>(T - taken, splat(least)), farthest = 0.5f * side * (1 - left);
    const Cells moved = gap + taken * (gap + v - low - 0.5f * wide) / left;
    const Cells step = maximum<float>(minimum<float>(moved, farthest), -farthest) - gap;
    gaps.x -= s.uy * step, gaps.y += s.ux * step;

    const Cells begin = (low + half) * scale - 0.5f, end = begin + wide * scale;
    const Mask<float> first = place(begin), last = place(end);
    const Cells density = taken * (much / (kCells * kCells)) / (wide * scale);
    Shown sum{};
    for (int c = 0; c < 3; ++c) {
        const auto between = [&](Cells a, Cells b) { return a + at.t * (b - a); };
        const Integral of(between(ends[0]->aside[c], ends[1]->aside[c]), between(ends[0]->sum[c], ends[1]->sum[c]));
        sum[c] = sum_cells(density * (of(end, last) - of(begin, first)));
    }
    return sum;
}

/// Colours across the wide segments of a block of tiles, and of the points of blocks before, as long as there is room.
class Sides {
  public:
    /// Starts a picture.
    void clear() { place_.clear(), ends_.clear(), across_.clear(); }

    /// Starts a block.
    void begin() {
        ends_.clear();
        if (across_.size() > kRoom) clear();
    }

    /// Whether a point's colours are there.
    bool has(uint32_t point) const { return place_.contains(point); }

    /// Room for the colours of points that are not there yet, in their order.
    Across *add(const std::vector<uint32_t> &points) {
        const size_t before = across_.size();
        for (size_t i = 0; i < points.size(); ++i) place_.emplace(points[i], uint32_t(before + i));
        across_.resize(before + points.size());
        return across_.data() + before;
    }

    /// Notes that segment i goes from `point` to the next one; their colours.
    std::array<const Across *, 2> join(uint32_t i, uint32_t point) {
        if (i >= ends_.size()) ends_.resize(2 * size_t(i) + 1);
        ends_[i] = {place_.at(point), place_.at(point + 1)};
        return ends(i);
    }

    /// Colours at both ends of segment i.
    std::array<const Across *, 2> ends(uint32_t i) const { return {&across_[ends_[i][0]], &across_[ends_[i][1]]}; }

  private:
    static constexpr size_t kRoom = 1 << 15; // points, 14 MB

    std::unordered_map<uint32_t, uint32_t> place_; // of points
    std::vector<std::array<uint32_t, 2>> ends_;    // of segments: the places of their points
    std::vector<Across> across_;
};

} // namespace ringlet
