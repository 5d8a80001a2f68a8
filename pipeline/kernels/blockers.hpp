// Which places of a strand a light reaches past all others, told exactly: for grooms of few strands, whose shadow maps would
// need nodes as narrow as a strand.
//
// Seen from the light, strands are bands on the map (u, v), w away from the light, cut into pieces no longer than a cell of
// the map, and each cell lists the pieces that may touch it, those nearest the light first. Where a stretch of a strand runs
// below a piece's band is an interval along the stretch: 16 places of the stretch that it hides are bits of a word, and the
// words of all pieces are joined by `or`, so that nothing depends on their order, nor on how often a piece is looked at.
// A strand's own segment and two on either side of it do not count: what a fibre does to its own light, its lobes say.
#pragma once

#include "casters.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ringlet {

/// Strands around 16 points.
struct Around {
    Vec3<float> axis, ways[2]; // [m] from the maps' centre on; to both sides along the strand
    Words strand;              // `Casters::name`
    Floats place;              // 0 at the root, 1 at the tip
    Ints told;                 // whether it is asked what light reaches them
};

class Blockers {
  public:
    bool empty() const { return begin_.empty(); }

    void clear() { begin_.clear(); }

    /// Takes in all strands, as the map's light sees them.
    void fill(const ShadowMap &map, const Casters &casters) {
        cell_ = std::max(kWide * map.width, 2 * map.spacing), segments_ = casters.P - 1;
        for (int k = 0; k < 2; ++k) low_[k] = map.low[k], n_[k] = int(map.spacing * map.n[k] / cell_) + 1;
        layer_ = float(std::max(-2 * map.low[2], map.spacing)) / kLayers;
        begin_.assign(size_t(n_[0]) * n_[1] + 1, 0);
        std::vector<Piece> pieces; // of all strands, in their order
        each_piece(map, casters, [&](const Piece &piece) {
            pieces.push_back(piece);
            each_cell(piece, [&](size_t cell) { ++begin_[cell + 1]; });
        });
        for (size_t cell = 1; cell < begin_.size(); ++cell) begin_[cell] += begin_[cell - 1];
        const std::vector<uint32_t> sorted = sort_into_cells(pieces);
        for (std::vector<float> &field : fields_) field.resize(begin_.back() + 16);
        strand_.resize(begin_.back() + 16);
        for (size_t to = 0; to < sorted.size(); ++to) {
            const Piece &piece = pieces[sorted[to]];
            for (int k = 0; k < 3; ++k) fields_[k][to] = piece.from[k], fields_[3 + k][to] = piece.way[k];
            fields_[6][to] = piece.radius, fields_[7][to] = piece.segment, strand_[to] = piece.strand;
        }
    }

    /// Part of the ways of 16 points that the map's light reaches; 0 where nobody asks.
    __attribute__((noinline)) Floats lit(const ShadowMap &map, const Around &around) const {
        alignas(64) float from[3][16], ways[6][16], segment[16], parts[16];
        alignas(64) uint32_t strand[16];
        for (int k = 0; k < 3; ++k) {
            write(from[k], on_axis(map.axis[k], around.axis) - map.low[k]);
            write(ways[k], on_axis(map.axis[k], around.ways[0])), write(ways[3 + k], on_axis(map.axis[k], around.ways[1]));
        }
        write(strand, around.strand), write(segment, around.place * float(segments_));
        const uint32_t told = set_lanes<float>(around.told);
        for (int i = 0; i < 16; ++i) {
            parts[i] = 0;
            if (!(told >> i & 1)) continue;
            int places = 0, hides = 0;
            for (int side = 0; side < 6; side += 3) {
                const Stretch one{{from[0][i], from[1][i], from[2][i]}, {ways[side][i], ways[side + 1][i], ways[side + 2][i]}, strand[i], segment[i]};
                if (one.way[0] == 0 && one.way[1] == 0 && one.way[2] == 0) continue; // beyond an end
                places += kPlaces, hides += __builtin_popcount(hidden(one));
            }
            parts[i] = places ? 1 - float(hides) / float(places) : 1;
        }
        Floats result;
        __builtin_memcpy(&result, parts, sizeof parts);
        return result;
    }

  private:
    static constexpr float kWide = 8, kOwn = 2.5f; // widths along a cell; segments
    static constexpr int kPlaces = 16;           // of a way
    static constexpr int kLayers = 256;
    static constexpr uint32_t kAll = (1u << kPlaces) - 1;

    struct Stretch {
        float from[3], way[3];
        uint32_t strand;
        float segment;
    };

    struct Piece : Stretch {
        float radius;
    };

    float cell_ = 1, layer_ = 1, low_[2] = {0, 0}; // [m]
    int n_[2] = {0, 0}, segments_ = 0;
    std::vector<size_t> begin_;    // of each cell's pieces
    std::vector<float> fields_[8]; // of pieces, cell after cell: from, way, radius, segment; 16 more
    std::vector<uint32_t> strand_;

    /// Which pieces are in each cell, cell after cell, by the layer in which they begin.
    std::vector<uint32_t> sort_into_cells(const std::vector<Piece> &pieces) const {
        std::vector<size_t> next(kLayers + 1);
        for (const Piece &piece : pieces) ++next[layer(piece.from[2], piece.way[2]) + 1];
        for (int layer = 0; layer < kLayers; ++layer) next[layer + 1] += next[layer];
        std::vector<uint32_t> order(pieces.size()), sorted(begin_.back());
        for (size_t i = 0; i < pieces.size(); ++i) order[next[layer(pieces[i].from[2], pieces[i].way[2])]++] = uint32_t(i);
        next.assign(begin_.begin(), begin_.end() - 1);
        for (const uint32_t i : order) each_cell(pieces[i], [&](size_t cell) { sorted[next[cell]++] = i; });
        return sorted;
    }

    /// The layer of the hair, from the light on, in which a piece begins.
    int layer(float from, float way) const {
        const float place = (from + std::min(way, 0.0f)) / layer_;
        return place > 0 ? int(std::min(place, kLayers - 1.0f)) : 0;
    }

    template <class Visit> void each_piece(const ShadowMap &map, const Casters &casters, Visit &&visit) const {
        for (size_t s = 0; s < casters.count; ++s)
            for (int j = 0; j < segments_; ++j) {
                const size_t at = s * casters.P + j;
                Piece whole{};
                for (int k = 0; k < 3; ++k) {
                    const float *a = map.axis[k];
                    whole.from[k] = a[0] * casters.x[0][at] + a[1] * casters.x[1][at] + a[2] * casters.x[2][at] - map.low[k];
                    whole.way[k] = a[0] * casters.x[0][at + 1] + a[1] * casters.x[1][at + 1] + a[2] * casters.x[2][at + 1] - map.low[k] - whole.from[k];
                }
                const float length = std::sqrt(whole.way[0] * whole.way[0] + whole.way[1] * whole.way[1]) / cell_;
                // Not-a-number and strands that broke cast no shadow
                if (!(length < 1e4f) || !(std::abs(whole.from[0]) < 1e4f * cell_) || !(std::abs(whole.from[1]) < 1e4f * cell_)) continue;
                const int pieces = int(length) + 1;
                whole.strand = casters.names[s], whole.segment = float(j) + 0.5f;
                whole.radius = 0.25f * (casters.widths[at] + casters.widths[at + 1]);
                for (int k = 0; k < 3; ++k) whole.way[k] /= float(pieces);
                Piece piece = whole;
                for (int i = 0; i < pieces; ++i) {
                    for (int k = 0; k < 3; ++k) piece.from[k] = whole.from[k] + float(i) * whole.way[k];
                    visit(piece);
                }
            }
    }

    /// The cell of a place along an axis: the nearest of those there are.
    int cell_at(float x, int k) const {
        const float cell = x / cell_, most = float(n_[k] - 1);
        return cell > 0 ? int(cell < most ? cell : most) : 0; // not-a-number is anywhere
    }

    /// First and last cell along an axis of what lies between two places.
    void range(float a, float b, float around, int k, int &first, int &last) const {
        first = cell_at(std::min(a, b) - around, k), last = cell_at(std::max(a, b) + around, k);
    }

    template <class Visit> void each_cell(const Piece &piece, Visit &&visit) const {
        int first[2], last[2];
        for (int k = 0; k < 2; ++k) range(piece.from[k], piece.from[k] + piece.way[k], 2 * piece.radius, k, first[k], last[k]);
        for (int i = first[0]; i <= last[0]; ++i)
            for (int j = first[1]; j <= last[1]; ++j) visit(size_t(i) * n_[1] + j);
    }

    uint32_t hidden(const Stretch &one) const {
        int first[2], last[2];
        for (int k = 0; k < 2; ++k) range(one.from[k], one.from[k] + one.way[k], 0, k, first[k], last[k]);
        const int deepest = layer(one.from[2] + std::max(one.way[2], 0.0f), 0);
        uint32_t bits = 0;
        for (int i = first[0]; i <= last[0]; ++i)
            for (int j = first[1]; j <= last[1]; ++j) {
                const size_t cell = size_t(i) * n_[1] + j, end = begin_[cell + 1];
                for (size_t k = begin_[cell]; k < end && layer(fields_[2][k], fields_[5][k]) <= deepest; k += 16) {
                    bits |= joined(hidden_by(k, end - k, one));
                    if (bits == kAll) return bits;
                }
            }
        return bits;
    }

    /// Bits that are set in any lane.
    static RINGLET_INLINE uint32_t joined(Words bits) {
        uint64_t pairs[8], all = 0;
        __builtin_memcpy(pairs, &bits, sizeof bits);
        for (const uint64_t pair : pairs) all |= pair;
        return uint32_t(all | all >> 32);
    }

    static RINGLET_INLINE Floats on_axis(const float axis[3], const Vec3<float> &x) { return axis[0] * x.x + axis[1] * x.y + axis[2] * x.z; }

    template <class Lanes, class Value> static RINGLET_INLINE void write(Value (&to)[16], const Lanes &lanes) {
        __builtin_memcpy(to, &lanes, sizeof lanes);
    }

    template <class Lanes, class Value> static RINGLET_INLINE Lanes read(const std::vector<Value> &from, size_t at) {
        Lanes lanes;
        __builtin_memcpy(&lanes, from.data() + at, sizeof lanes);
        return lanes;
    }

    /// Narrows from .. to, each of 16, to where a + t b lies within `half` of 0.
    static RINGLET_INLINE void narrow(Floats a, Floats b, Floats half, Floats &from, Floats &to) {
        constexpr float least = 1e-20f;
        const Floats inverse = reciprocal<float>((b < least) & (b > -least) ? splat(least) : b);
        const Floats p = (-half - a) * inverse, q = (half - a) * inverse;
        from = maximum<float>(from, minimum<float>(p, q)), to = minimum<float>(to, maximum<float>(p, q));
    }

    /// Places of a stretch that 16 pieces hide, of which `count` are there.
    RINGLET_INLINE Words hidden_by(size_t at, size_t count, const Stretch &one) const {
        const Floats du = read<Floats>(fields_[3], at), dv = read<Floats>(fields_[4], at), radius = read<Floats>(fields_[6], at);
        const Floats qu = one.from[0] - read<Floats>(fields_[0], at), qv = one.from[1] - read<Floats>(fields_[1], at);
        const Floats squared = du * du + dv * dv + 1e-16f, inverse = inverse_root<float>(squared), length = squared * inverse;
        // Along the band and across it, of the stretch's beginning and of its way [m]
        const Floats along = (qu * du + qv * dv) * inverse, across = (qu * dv - qv * du) * inverse;
        const Floats further = (one.way[0] * du + one.way[1] * dv) * inverse, aside = (one.way[0] * dv - one.way[1] * du) * inverse;
        Floats from = splat(0.0f), to = splat(1.0f);
        narrow(across, aside, radius, from, to);
        // Half a disc at either end closes the gaps at bends: as much longer as makes its area
        narrow(along - 0.5f * length, further, 0.5f * length + 0.785f * radius, from, to);
        const Floats middle = 0.5f * (from + to), part = clamp((along + middle * further) * inverse, 0, 1);
        const Floats below = one.from[2] + middle * one.way[2] - read<Floats>(fields_[2], at) - part * read<Floats>(fields_[5], at);
        const Floats apart = magnitude(read<Floats>(fields_[7], at) - one.segment);
        Floats lane;
        for (int k = 0; k < 16; ++k) lane[k] = float(k);
        const Ints own = (Ints)(read<Words>(strand_, at) == one.strand) & (apart < kOwn);
        const Ints hides = (from < to) & (below > 0.0f) & ~own & (lane < float(count));
        const Words first = (Words)whole((hides ? from : splat(0.0f)) * float(kPlaces) + 0.5f), last = (Words)whole((hides ? to : splat(0.0f)) * float(kPlaces) + 0.5f);
        return ((Words{} + 1u) << last) - ((Words{} + 1u) << first);
    }
};

} // namespace ringlet
