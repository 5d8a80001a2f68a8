// What a fibre scatters at places across it: S at the offset h is sum over the lobes of M_p A_p(h) D_p(phi - Phi_p(h)), with
//
//     Phi_p(h) = 2 p asin(h / eta') - 2 asin(h) + p pi,   eta'^2 = (eta^2 - sin^2 theta) / cos^2 theta,
//
// D_p a logistic of scale s. Places are the sixteenths of the fibre's width: A_p is the mean over each (pipeline/render/fibre.py)
// and D_p too, where Phi_p goes evenly from one side of it to the other. Divided by their mean they say how much of the lobe
// that all of the fibre shows (fibre.hpp) is seen there, so that the mean over the width is exactly that.
//
// phi is positive where the light stands on the side of positive h; h is what the eye sees, to the right of who goes from
// root to tip (across.hpp). Light that is scattered more than once looks the same at all places, and light from the sky.
//
// Source: Chiang et al., A Practical and Controllable Hair and Fur Model, Eurographics 2016.
#pragma once

#include "fibre.hpp"
#include "strand_point.hpp"

#include <cmath>

namespace ringlet {

constexpr float kPi = 3.14159265f;

/// Strands whose places all look the same.
struct MeanOnly {
    RINGLET_INLINE void turn(Floats, Floats) {}
    RINGLET_INLINE void add(int, Floats, const Floats[4], const Floats[8], Floats) {}
};

/// 16 points of strands, and what their places show beyond the mean.
class NearField {
  public:
    /// Absorption in entries of the tables, the eye's inclination and its cosine.
    NearField(const FibreTables &tables, const Floats level[3], const Place &theta, Floats cosine)
        : tables_(tables), whole_(1 / std::tanh(kPi / (2 * tables.scale))) {
        for (int c = 0; c < 3; ++c) {
            read<Record>(tables.across, tables.T, Place(level[c], tables.A), theta, leaving_[c]);
            for (Floats &each : aside_[c]) each = splat(0.0f);
        }
        const Floats sine2 = 1.0f - cosine * cosine, slower = cosine / square_root<float>(tables.eta * tables.eta - sine2);
        for (int i = 0; i <= kHalf; ++i) {
            const Floats h = splat(float(i) / kHalf);
            inside_[i] = 0.5f * kPi - arc_cosine(h * slower), outside_[i] = 0.5f * kPi - arc_cosine(h);
        }
    }

    /// From now on of a light at the azimuth phi from the eye's, of which each point sees this part.
    void turn(Floats phi, Floats seen) {
        some_ = any<float>(seen > 0.0f);
        if (!some_) return;
        for (int p = 0; p < 3; ++p) {
            Angle before;
            for (int i = 0; i <= kCount; ++i) {
                const int k = std::abs(i - kHalf);
                const Floats bent = 2.0f * float(p) * inside_[k] - 2.0f * outside_[k];
                // Against h: the light enters where the eye would see it leave
                const Angle side = angle(phi + (i < kHalf ? -bent : bent) - float(p) * kPi);
                if (i > 0) turned_[p][i - 1] = density(before, side);
                before = side;
            }
        }
    }

    /// Adds a light's share in channel c: `once` is what is seen of it in the mean, of these lobes and their M.
    __attribute__((noinline)) void add(int c, Floats lit, const Floats M[4], const Floats N[8], Floats once) {
        if (!some_) return;
        Floats sum[kCount];
        for (Floats &each : sum) each = -once;
        for (int p = 0; p < 4; ++p) {
            Floats part[kCount], all = splat(0.0f);
            for (int k = 0; k < kCount; ++k) {
                part[k] = leaving_[c][p * kHalf + (k < kHalf ? kHalf - 1 - k : k - kHalf)];
                if (p < 3) part[k] *= turned_[p][k];
                part[k] += 1e-12f; // where there is no light, it is everywhere alike
                all += part[k];
            }
            const Floats scale = M[p] * N[p] * float(kCount) / all;
            for (int k = 0; k < kCount; ++k) sum[k] += scale * part[k];
        }
        for (int k = 0; k < kCount; ++k) aside_[c][k] += lit * sum[k];
    }

    /// Writes the first `count` points.
    void write(const Floats mean[3], size_t count, Across *to) const {
        for (size_t i = 0; i < count; ++i) {
            for (int c = 0; c < 3; ++c) {
                to[i].mean[c] = mean[c][i];
                float sum = 0, last = 0;
                for (int k = 0; k < kCount; ++k) {
                    const float here = aside_[c][k][i];
                    if (k > 0) sum += 0.5f * (last + here);
                    to[i].aside[c][k] = last = here, to[i].sum[c][k] = sum;
                }
            }
        }
    }

  private:
    static constexpr int kCount = Across::kPlaces, kHalf = kCount / 2;
    typedef float Record __attribute__((vector_size(4 * 4 * kHalf))); // all places of all lobes

    const FibreTables &tables_;
    const float whole_; // what makes all of the logistic that lies in one turn 1
    Floats leaving_[3][4 * kHalf];                   // A_p over its mean, R, G, B
    Floats inside_[kHalf + 1], outside_[kHalf + 1]; // asin(h / eta') and asin(h) between the places
    Floats turned_[3][kCount];                       // mean of D over each
    Floats aside_[3][kCount];
    bool some_ = false;

    /// An angle, the integral of D up to it, and D times its scale.
    struct Angle {
        Floats x, sum, here;
    };

    RINGLET_INLINE Angle angle(Floats x) const {
        const Floats turns = nearest<float>(x * (0.5f / kPi)), rest = (x - 2 * kPi * turns) * (1 / tables_.scale);
        const Floats part = reciprocal<float>(1.0f + exponential(clamp(-rest, -80, 80)));
        return {x, turns + (part - 0.5f) * whole_, part * (1.0f - part)};
    }

    /// Mean of D from an angle to another one.
    RINGLET_INLINE Floats density(const Angle &a, const Angle &b) const {
        constexpr float narrow = 0.02f; // [rad] where the difference of sums is rounding
        const Floats way = b.x - a.x;
        const Mask<float> wide = magnitude(way) > narrow;
        const Floats over = maximum<float>((b.sum - a.sum) * reciprocal<float>(wide ? way : splat(1.0f)), splat(0.0f));
        return wide ? over : (a.here + b.here) * (0.5f / tables_.scale);
    }
};

} // namespace ringlet
