// What the head carries of a strand at rest: forces r_k >= 0 along its normals at supported points, chosen so that the
// rest shape changes least.
//
// Any r gives an exact equilibrium; this one minimises sum_i sum_a dl_i s_ia^2 / B_a, where s = s0 + S r. With
// Q = S^T C S, c = S^T C s0, C = dl / B it is min r^T Q r / 2 + c^T r over r >= 0: non-negative least squares by the
// active set of Lawson and Hanson (Solving Least Squares Problems, 1974).
// Friction is left out: at rest it can only add to what holds.
#pragma once

#include "statics.hpp"

#include <vector>

namespace ringlet {

/// min r^T Q r / 2 + c^T r over r >= 0, with Q (n, n) positive semi-definite.
class NonNegative {
  public:
    NonNegative(std::vector<double> Q, std::vector<double> c) : n_(int(c.size())), Q_(std::move(Q)), c_(std::move(c)) {}

    std::vector<double> solve() {
        std::vector<double> r(n_, 0.0);
        free_.assign(n_, 0);
        double size = 0;
        for (double value : c_) size = std::max(size, std::abs(value));
        for (int round = 0; round < 3 * n_; ++round) {
            int best = -1;
            double most = kGain * size;
            for (int k = 0; k < n_; ++k) {
                double gain = -c_[k];
                for (int j = 0; j < n_; ++j) gain -= Q_[k * n_ + j] * r[j];
                if (!free_[k] && gain > most) most = gain, best = k;
            }
            if (best < 0) break;
            free_[best] = 1;
            descend(r);
        }
        return r;
    }

  private:
    static constexpr double kGain = 1e-9, kRidge = 1e-12; // relative to c; to the diagonal of Q
    int n_;
    std::vector<double> Q_, c_;
    std::vector<char> free_;

    /// Goes to the minimum over the free variables, or as far as they all stay positive, dropping those that do not.
    void descend(std::vector<double> &r) {
        for (int round = 0; round <= n_; ++round) {
            std::vector<double> z = minimum();
            double part = 1;
            int first = -1;
            for (int k = 0; k < n_; ++k)
                if (free_[k] && z[k] <= 0 && r[k] / (r[k] - z[k]) < part) part = r[k] / (r[k] - z[k]), first = k;
            for (int k = 0; k < n_; ++k) r[k] = free_[k] ? r[k] + part * (z[k] - r[k]) : 0;
            if (first < 0) return;
            free_[first] = 0, r[first] = 0;
        }
    }

    /// The minimum over the free variables, whatever its sign, by Cholesky.
    std::vector<double> minimum() const {
        std::vector<int> index;
        for (int k = 0; k < n_; ++k)
            if (free_[k]) index.push_back(k);
        const int m = int(index.size());
        std::vector<double> A(size_t(m) * m), y(m), z(n_, 0.0);
        for (int i = 0; i < m; ++i) {
            for (int j = 0; j <= i; ++j) {
                double value = Q_[index[i] * n_ + index[j]] * (i == j ? 1 + kRidge : 1);
                for (int k = 0; k < j; ++k) value -= A[i * m + k] * A[j * m + k];
                const double least = kRidge * Q_[index[i] * n_ + index[i]];
                A[i * m + j] = i == j ? std::sqrt(std::max(value, least)) : value / A[j * m + j];
            }
            y[i] = -c_[index[i]];
            for (int k = 0; k < i; ++k) y[i] -= A[i * m + k] * y[k];
            y[i] /= A[i * m + i];
        }
        for (int i = m - 1; i >= 0; --i) {
            for (int k = i + 1; k < m; ++k) y[i] -= A[k * m + i] * y[k];
            y[i] /= A[i * m + i];
            z[index[i]] = y[i];
        }
        return z;
    }
};

/// The head yields a little, in units of the strand's compliance L^3 / (3 B1): beside the clamp a point could carry
/// hundreds of weights for next to nothing, and the least give there would turn the whole strand.
inline constexpr double kYield = 1e-3;

/// The reactions of one lane of a block in balance: `r[k]` at the points whose normal n[k] is not zero.
class Reactions {
  public:
    Reactions(const StaticBlock &block, const Vector *n, int lane) : block_(block), lane_(lane) {
        for (int k = 1; k < block.P; ++k)
            if (dot(at(n[k]), at(n[k])) > 0.25 && block.turns[k - 1][lane] > 0) points_.push_back(k), normals_.push_back(at(n[k]));
    }

    int count() const { return int(points_.size()); }

    /// Writes r [N] of the points.
    void solve(Many *r) const {
        const int n = count(), P = block_.P;
        std::vector<double> Q(size_t(n) * n, 0.0), c(n, 0.0);
        std::vector<double> S(n);
        for (int i = 1; i < P - 1; ++i) {
            if (!(block_.turns[i][lane_] > 0)) continue;
            const Vec here = at(block_.x[i]);
            for (int a = 0; a < 3; ++a) {
                const Vec dual = at(block_.joint[i].dual[a]);
                const double weight = block_.joint[i].dl[lane_] / block_.B[a][lane_];
                for (int k = 0; k < n; ++k) {
                    S[k] = points_[k] > i ? dot(dual, cross(at(block_.x[points_[k]]) - here, normals_[k])) : 0;
                    c[k] += weight * S[k] * block_.joint[i].s[a][lane_];
                    for (int j = 0; j <= k; ++j) Q[k * n + j] += weight * S[k] * S[j];
                }
            }
        }
        const double yield = kYield * std::pow(reach(), 3) / (3 * block_.B[0][lane_]);
        for (int k = 0; k < n; ++k) {
            Q[k * n + k] += yield;
            for (int j = 0; j < k; ++j) Q[j * n + k] = Q[k * n + j];
        }
        const std::vector<double> found = NonNegative(std::move(Q), std::move(c)).solve();
        for (int k = 0; k < n; ++k) r[points_[k]][lane_] = found[k];
    }

  private:
    /// Length of the strand.
    double reach() const {
        double length = 0;
        for (int j = 0; j < block_.P - 1; ++j) length += block_.turns[j][lane_] * block_.l[j][lane_];
        return length;
    }

    const StaticBlock &block_;
    int lane_;
    std::vector<int> points_;
    std::vector<Vec> normals_;

    Vec at(const Vector &v) const { return {v.x[lane_], v.y[lane_], v.z[lane_]}; }
};

} // namespace ringlet
