// Whether the straight way between two roots, in the scalp's chart, crosses a parting.
//
// Notation: a way from a to b, a segment of a parting from p to q, all points of the plane. The way crosses the segment
// where a and b lie on different sides of the line p q, and p and q on different sides of the line a b. A point on a line
// counts as to its left: so a way through the point that two segments share crosses exactly one of them, and roots on
// a parting belong to one side of it. The ends of a way are put in order first: there and back are the same way.
// Segments are first picked by the box around all ways of a root: most roots are far from any parting.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ringlet {

struct Flat {
    double u, v;
};

struct PartingSegment {
    Flat p, q;
};

inline bool left_of(Flat from, Flat to, Flat x) {
    return (to.u - from.u) * (x.v - from.v) - (to.v - from.v) * (x.u - from.u) >= 0;
}

inline bool crosses(const PartingSegment &s, Flat a, Flat b) {
    if (b.u < a.u || (b.u == a.u && b.v < a.v)) std::swap(a, b);
    return left_of(s.p, s.q, a) != left_of(s.p, s.q, b) && left_of(a, b, s.p) != left_of(a, b, s.q);
}

/// A box of the plane, empty at first.
struct FlatBox {
    double low_u = 1e300, low_v = 1e300, high_u = -1e300, high_v = -1e300;

    void take(Flat x) {
        low_u = x.u < low_u ? x.u : low_u, high_u = x.u > high_u ? x.u : high_u;
        low_v = x.v < low_v ? x.v : low_v, high_v = x.v > high_v ? x.v : high_v;
    }
    bool meets(const FlatBox &other) const {
        return low_u <= other.high_u && other.low_u <= high_u && low_v <= other.high_v && other.low_v <= high_v;
    }
};

/// All partings of a groom.
class PartingLines {
  public:
    explicit PartingLines(std::vector<PartingSegment> segments) : segments_(std::move(segments)) {
        for (size_t i = 0; i < segments_.size(); ++i) {
            FlatBox box;
            box.take(segments_[i].p), box.take(segments_[i].q);
            boxes_.push_back(box);
            if (i % kRun == 0) runs_.emplace_back();
            runs_.back().take(segments_[i].p), runs_.back().take(segments_[i].q);
        }
    }

    /// Segments that can meet a way within the box, appended to `near`.
    void pick(const FlatBox &ways, std::vector<PartingSegment> &near) const {
        for (size_t run = 0; run < runs_.size(); ++run) {
            if (!runs_[run].meets(ways)) continue;
            const size_t end = (run + 1) * kRun < segments_.size() ? (run + 1) * kRun : segments_.size();
            for (size_t i = run * kRun; i < end; ++i)
                if (boxes_[i].meets(ways)) near.push_back(segments_[i]);
        }
    }

  private:
    static constexpr size_t kRun = 16; // segments that follow each other and share a box
    std::vector<PartingSegment> segments_;
    std::vector<FlatBox> boxes_, runs_;
};

/// across[k] = whether the way from `root` to target `candidate[k]` crosses a parting, for K candidates; `near` is scratch.
inline void ways_across(const PartingLines &lines, Flat root, const Flat *targets, const int64_t *candidate, size_t K,
                        std::vector<PartingSegment> &near, bool *across) {
    FlatBox ways;
    ways.take(root);
    for (size_t k = 0; k < K; ++k) ways.take(targets[candidate[k]]);
    near.clear();
    lines.pick(ways, near);
    for (size_t k = 0; k < K; ++k) {
        bool found = false;
        for (const PartingSegment &segment : near) found = found || crosses(segment, root, targets[candidate[k]]);
        across[k] = found;
    }
}

} // namespace ringlet
