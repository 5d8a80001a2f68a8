// Which of its candidate guides a strand follows, and how much.
//
// Notation: c(a, b) distance of two strands: roots and shapes, both in units of their scales; the k candidates with the
// least c(g, strand) are taken, the next one is at c'. Weights are those of ordinary kriging with a linear variogram:
//     sum_h w_h c(g, h) - v_g w_g + mu = c(g, strand) for each g,   sum_g w_g = 1,
// negative ones left out: two guides beside each other share the weight that one alone would have. v_g is what a measured
// value's uncertainty is there, 2 c(g, strand) (1 / f - 1): f falls from 1 at the first guide to 0 at c', so that nothing
// jumps where the next guide takes a place, and to 0 where the guide's shape is far from that of the first: at a clump's
// border a strand follows the guide that it resembles, not a mean that is neither.
// Everything of a strand depends on that strand alone; of equal candidates the first wins.
// Source: Matheron, "Principles of geostatistics" (1963). Ours: the distance and the fades.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ringlet {

inline constexpr int kCandidatesMax = 64, kGuidesTaken = 8;

/// Rows of root and shape, side by side: (n, D), in units of their scales; the first three columns are the root.
struct Features {
    const double *values;
    size_t count;
};

struct Follow {
    Features guides;
    int dimensions, candidates, k;
    double alike, unlike; // |D_g - D_1| at which a guide begins to fade out, and at which it is gone

    /// Chooses among candidate[0 .. candidates), rows of the guides or negative for none. Guides beyond the last chosen
    /// one repeat the first, of weight 0; of a strand without candidates all do.
    void operator()(const double *strand, const int64_t *candidate, uint32_t *guide, float *weight) const {
        double cost[kCandidatesMax];
        int64_t chosen[kCandidatesMax];
        int found = 0;
        for (int i = 0; i < candidates; ++i) {
            if (candidate[i] < 0) continue;
            const double c = difference(strand, row(candidate[i]), 0);
            int at = found++;
            for (; at > 0 && c < cost[at - 1]; --at) cost[at] = cost[at - 1], chosen[at] = chosen[at - 1];
            cost[at] = c, chosen[at] = candidate[i];
        }
        const int taken = found < k ? found : k;
        double certain[kGuidesTaken] = {}, share[kGuidesTaken] = {}, sum = 0;
        const double beyond = found > k ? std::sqrt(cost[k]) + 1e-9 : 0;
        for (int g = 0; g < taken; ++g) {
            certain[g] = fading(std::sqrt(difference(row(chosen[g]), row(chosen[0]), 3)), alike, unlike);
            if (found > k) certain[g] *= (beyond - std::sqrt(cost[g])) / (beyond - std::sqrt(cost[0]));
        }
        kriging(chosen, cost, certain, taken, share);
        for (int g = 0; g < taken; ++g) sum += share[g];
        for (int g = 0; g < k; ++g) {
            guide[g] = uint32_t(taken ? chosen[g < taken ? g : 0] : 0);
            weight[g] = g >= taken ? 0 : sum > 1e-9 ? float(share[g] / sum) : float(g == 0);
        }
        for (int g = 1; g < taken; ++g)
            for (int at = g; at > 0 && weight[at] > weight[at - 1]; --at)
                std::swap(weight[at], weight[at - 1]), std::swap(guide[at], guide[at - 1]);
    }

  private:
    const double *row(int64_t g) const { return guides.values + size_t(g) * dimensions; }

    /// Square of the difference, from column `first` on.
    double difference(const double *a, const double *b, int first) const {
        double sum = 0;
        for (int i = first; i < dimensions; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
        return sum;
    }

    /// Shares of n guides at squares of distance `cost` from the strand, certain to 0 .. 1; none is negative.
    void kriging(const int64_t *guide, const double *cost, const double *certain, int n, double *share) const {
        constexpr int kSide = kGuidesTaken + 1;
        constexpr double kNugget = 1e-6; // keeps guides that are alike apart
        double m[kSide][kSide + 1]; // the equations, their right side last
        for (int g = 0; g < n; ++g) {
            for (int h = 0; h < n; ++h)
                m[g][h] = kNugget + std::sqrt(difference(row(guide[g]), row(guide[h]), 0));
            m[g][n] = m[n][g] = 1;
            m[g][n + 1] = kNugget + std::sqrt(cost[g]);
            m[g][g] = -2 * m[g][n + 1] * (1 / (certain[g] + 1e-9) - 1);
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
        for (int g = 0; g < n; ++g) share[g] = solution[g] > 0 ? solution[g] : 0;
    }

    /// 1 up to `from`, 0 beyond `to`.
    static double fading(double x, double from, double to) {
        const double u = (to - x) / (to - from), t = u < 0 ? 0 : u > 1 ? 1 : u;
        return t * t * (3 - 2 * t);
    }
};

} // namespace ringlet
