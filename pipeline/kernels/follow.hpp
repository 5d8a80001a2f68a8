// Which of its candidate guides a strand follows, and how much.
//
// Notation: c(a, b) distance of two strands: roots and shapes, both in units of their scales. The weights of guides g are
// those of ordinary kriging with a linear variogram:
//     sum_h w_h c(g, h) - v_g w_g + mu = c(g, strand) for each g,   sum_g w_g = 1,
// negative ones left out: two guides beside each other share the weight that one alone would have. v_g is what a measured
// value's uncertainty is there, 2 c(g, strand) (1 / f_g - 1). It is done twice: over the k + 2 nearest candidates, and
// again over the k of greatest weight, which stand around the strand where the k nearest may all be on one side of it.
// f_g falls to 0 for a guide that is about to lose its place, in the last part before the next candidate's distance and
// then before the next one's weight, so that little jumps where another takes it; and where its shape is far from that of
// the nearest: at a clump's border a strand follows the guides that it resembles, not a mean that is neither.
// Everything of a strand depends on that strand alone; of equal candidates the first wins.
// Source: Matheron, "Principles of geostatistics" (1963). Ours: the distance, the choice and f.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ringlet {

inline constexpr int kCandidatesMax = 64, kFollowedMax = 8, kMoreThanFollowed = 2;

/// Rows of root and shape, side by side: (n, D), in units of their scales; the first three columns are the root.
struct Features {
    const double *values;
    size_t count;
};

/// Guides of a strand, the nearest first until they are ranked by weight.
struct Ranked {
    int n = 0;
    int64_t guide[kCandidatesMax] = {};
    double cost[kCandidatesMax] = {}; // c^2
    double weight[kFollowedMax + kMoreThanFollowed] = {}, certain[kFollowedMax + kMoreThanFollowed] = {}; // w, f

    void swap(int a, int b) {
        std::swap(guide[a], guide[b]), std::swap(cost[a], cost[b]);
        std::swap(weight[a], weight[b]), std::swap(certain[a], certain[b]);
    }

    /// Puts the first n in the order of their weights; equal ones stay as they are.
    void rank() {
        for (int g = 1; g < n; ++g)
            for (int at = g; at > 0 && weight[at] > weight[at - 1]; --at) swap(at, at - 1);
    }
};

struct Follow {
    Features guides;
    int dimensions, candidates, k;
    double alike, unlike; // |D_g - D_1| at which a guide begins to fade out, and at which it is gone

    /// Chooses among candidate[0 .. candidates), rows of the guides or negative for none. Guides beyond the last chosen
    /// one repeat the first, of weight 0; of a strand without candidates all do.
    void operator()(const double *strand, const int64_t *candidate, uint32_t *guide, float *weight) const {
        Ranked to;
        nearest(strand, candidate, to);
        const int64_t first = to.guide[0];
        kriging(to);
        to.rank();
        if (to.n > k) {
            for (int g = 0; g < k; ++g) {
                const double lead = (to.weight[g] - to.weight[k]) / (kHeavy * to.weight[0]);
                to.certain[g] = std::min(lead, 1.0) * alikeness(to.guide[g], first);
            }
            to.n = k;
            kriging(to);
            to.rank();
        }
        for (int g = 0; g < k; ++g) {
            guide[g] = uint32_t(to.n ? to.guide[g < to.n ? g : 0] : 0);
            weight[g] = g < to.n ? float(to.weight[g]) : 0;
        }
    }

  private:
    static constexpr double kNear = 0.3, kHeavy = 0.5; // parts of the next distance and of the greatest weight

    /// The k + 2 nearest candidates, how certain they are, and no weights.
    void nearest(const double *strand, const int64_t *candidate, Ranked &to) const {
        int found = 0;
        for (int i = 0; i < candidates; ++i) {
            if (candidate[i] < 0) continue;
            const double c = difference(strand, row(candidate[i]), 0);
            int at = found++;
            for (; at > 0 && c < to.cost[at - 1]; --at)
                to.cost[at] = to.cost[at - 1], to.guide[at] = to.guide[at - 1];
            to.cost[at] = c, to.guide[at] = candidate[i];
        }
        to.n = std::min(found, k + kMoreThanFollowed);
        for (int g = 0; g < to.n; ++g) {
            to.certain[g] = alikeness(to.guide[g], to.guide[0]);
            if (found == to.n) continue;
            const double beyond = std::sqrt(to.cost[to.n]) + 1e-9;
            to.certain[g] *= std::min((beyond - std::sqrt(to.cost[g])) / (kNear * beyond), 1.0);
        }
    }

    const double *row(int64_t g) const { return guides.values + size_t(g) * dimensions; }

    /// Square of the difference, from column `first` on.
    double difference(const double *a, const double *b, int first) const {
        double sum = 0;
        for (int i = first; i < dimensions; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
        return sum;
    }

    /// Weights of the guides; none is negative, their sum is 1.
    void kriging(Ranked &to) const {
        constexpr int kSide = kFollowedMax + kMoreThanFollowed + 1;
        constexpr double kNugget = 1e-6; // keeps guides that are alike apart
        const int n = to.n;
        double m[kSide][kSide + 1]; // the equations, their right side last
        for (int g = 0; g < n; ++g) {
            for (int h = 0; h < n; ++h)
                m[g][h] = kNugget + std::sqrt(difference(row(to.guide[g]), row(to.guide[h]), 0));
            m[g][n] = m[n][g] = 1;
            m[g][n + 1] = kNugget + std::sqrt(to.cost[g]);
            m[g][g] = -2 * m[g][n + 1] * (1 / (to.certain[g] + 1e-9) - 1);
        }
        m[n][n] = 0, m[n][n + 1] = 1;
        for (int c = 0; c <= n; ++c) {
            int pivot = c;
            for (int r = c + 1; r <= n; ++r)
                if (std::abs(m[r][c]) > std::abs(m[pivot][c])) pivot = r;
            for (int i = c; i <= n + 1; ++i) std::swap(m[c][i], m[pivot][i]);
            for (int r = c + 1; r <= n; ++r) {
                const double factor = m[r][c] / m[c][c];
                for (int i = c; i <= n + 1; ++i) m[r][i] -= factor * m[c][i];
            }
        }
        double solution[kSide];
        for (int r = n; r >= 0; --r) {
            solution[r] = m[r][n + 1];
            for (int i = r + 1; i <= n; ++i) solution[r] -= m[r][i] * solution[i];
            solution[r] /= m[r][r];
        }
        double sum = 0;
        for (int g = 0; g < n; ++g) sum += to.weight[g] = solution[g] > 0 ? solution[g] : 0;
        for (int g = 0; g < n; ++g) to.weight[g] = sum > 1e-9 ? to.weight[g] / sum : double(g == 0);
    }

    /// 1 where guide a has about the shape of b, falling to 0.
    double alikeness(int64_t a, int64_t b) const {
        const double apart = std::sqrt(difference(row(a), row(b), 3));
        const double u = (unlike - apart) / (unlike - alike), t = u < 0 ? 0 : u > 1 ? 1 : u;
        return t * t * (3 - 2 * t);
    }
};

} // namespace ringlet
