// What holds a strand at rest beyond its clamped root: the head, with forces r_k >= 0 along its normals at supported
// points, and whatever else holds points and segments, with any force and couple; chosen so that the rest shape changes
// least.
//
// Any of these give an exact equilibrium; we minimise sum_i sum_a dl_i s_ia^2 / B_a, where s = s0 + S r. With
// Q = S^T C S, c = S^T C s0, C = dl / B it is min r^T Q r / 2 + c^T r: non-negative least squares by the active set of
// Lawson and Hanson (Solving Least Squares Problems, 1974), with some variables of any sign.
// Friction is left out: at rest it can only add to what holds.
#pragma once

#include "statics.hpp"

#include <vector>

namespace ringlet {

/// min r^T Q r / 2 + c^T r with Q (n, n) positive definite; the first `any` of r may be negative.
class NonNegative {
  public:
    NonNegative(std::vector<double> Q, std::vector<double> c, int any)
        : n_(int(c.size())), any_(any), Q_(std::move(Q)), c_(std::move(c)) {}

    std::vector<double> solve() {
        std::vector<double> r(n_, 0.0);
        free_.assign(n_, 0);
        for (int k = 0; k < any_; ++k) free_[k] = 1;
        if (any_ > 0) descend(r);
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
    int n_, any_;
    std::vector<double> Q_, c_;
    std::vector<char> free_;

    /// Goes to the minimum over the free variables, or as far as they all stay positive, dropping those that do not.
    void descend(std::vector<double> &r) {
        for (int round = 0; round <= n_; ++round) {
            std::vector<double> z = minimum();
            double part = 1;
            int first = -1;
            for (int k = any_; k < n_; ++k)
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

/// Everything yields a little, in units of the strand's compliance L^3 / (3 B1): beside the clamp a point could carry
/// hundreds of weights for next to nothing, and the least give there would turn the whole strand.
inline constexpr double kYield = 1e-3;

/// The unknown forces and couples on one lane of a block: those of what is held beyond the root, and of the points whose
/// normal n[k] is not zero where the strand may lean on the head.
class Reactions {
  public:
    Reactions(const StaticBlock &block, int lane) : block_(block), lane_(lane) {
        int root = 0;
        while (root < block.P - 1 && !turns(root)) ++root;
        for (int k = root + 1; k < block.P; ++k) {
            const bool segment = k < block.P - 1 && !turns(k);
            if (block.held[k][lane] > 0)
                for (int a = 0; a < 3; ++a) columns_.push_back({k, k, false, axis(a)});
            if (segment)
                for (int a = 0; a < 3; ++a) columns_.push_back({k, k + 1, true, axis(a)});
        }
        any_ = int(columns_.size());
    }

    /// Lets the head carry the points with normals.
    void lean(const Vector *n) {
        for (int k = 1; k < block_.P; ++k)
            if (dot(at(n[k]), at(n[k])) > 0.25 && !(block_.held[k][lane_] > 0)) columns_.push_back({k, k, false, at(n[k])});
    }

    int count() const { return int(columns_.size()); }

    /// Writes r [N] of the points with normals, and adds all forces [N] and couples [N m] to their arrays.
    void solve(Many *r, Vector *force, Vector *couple) const {
        const std::vector<double> found = least_change();
        for (int k = 0; k < count(); ++k) {
            const Column &column = columns_[k];
            add(column.couple ? couple[column.index] : force[column.index], found[k] * column.direction);
            if (k >= any_) r[column.index][lane_] = found[k];
        }
    }

  private:
    /// A unit force on point `index`, or a unit couple on segment `index`; joints from `end` on do not feel it.
    struct Column {
        int index, end;
        bool couple;
        Vec direction;
    };

    const StaticBlock &block_;
    int lane_, any_ = 0;
    std::vector<Column> columns_;

    static Vec axis(int a) { return {double(a == 0), double(a == 1), double(a == 2)}; }
    Vec at(const Vector &v) const { return {v.x[lane_], v.y[lane_], v.z[lane_]}; }
    void add(Vector &to, Vec v) const { to.x[lane_] += v.x, to.y[lane_] += v.y, to.z[lane_] += v.z; }
    bool turns(int j) const { return block_.turns[j][lane_] > 0; }

    /// What a column gives joint i.
    Vec moment(const Column &column, int i) const {
        if (i >= column.end) return {0, 0, 0};
        return column.couple ? column.direction
                             : cross(at(block_.x[column.index]) - at(block_.x[i]), column.direction);
    }

    std::vector<double> least_change() const {
        const int n = count();
        std::vector<double> Q(size_t(n) * n, 0.0), c(n, 0.0), S(n);
        for (int i = 1; i < block_.P - 1; ++i) {
            const StaticJoint &joint = block_.joint[i];
            if (!(joint.live[lane_] > 0)) continue;
            for (int a = 0; a < 3; ++a) {
                const double weight = joint.dl[lane_] / block_.B[a][lane_];
                for (int k = 0; k < n; ++k) {
                    S[k] = dot(at(joint.dual[a]), moment(columns_[k], i));
                    c[k] += weight * S[k] * joint.s[a][lane_];
                    for (int j = 0; j <= k; ++j) Q[k * n + j] += weight * S[k] * S[j];
                }
            }
        }
        double reach = 0;
        for (int j = 0; j < block_.P - 1; ++j) reach += block_.turns[j][lane_] * block_.l[j][lane_];
        const double yield = kYield * reach / (3 * block_.B[0][lane_]);
        for (int k = 0; k < n; ++k) {
            Q[k * n + k] += columns_[k].couple ? yield : yield * reach * reach;
            for (int j = 0; j < k; ++j) Q[j * n + k] = Q[k * n + j];
        }
        return NonNegative(std::move(Q), std::move(c), any_).solve();
    }
};

} // namespace ringlet
