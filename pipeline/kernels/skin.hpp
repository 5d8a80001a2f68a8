// What skin does to light: it scatters below the surface, so that light goes round curves, red the farthest, and it has a
// soft gloss.
//
// Notation: c = N.L, kappa curvature of the surface [1/m]. On a ring of radius 1 / kappa the diffuse light max(c, 0) is
// blurred by the scattering profile, a sum of Gaussians of variance v_k with weights w_k of R, G, B: with s = kappa sqrt(v)
//     E(c, s) = e^(-s^2/2) (c Phi(c/s) + s phi(c/s)),   Phi, phi of the standard normal distribution,
// the mean of max(c + s z, 0) over normal z, where the cosine is taken as straight around 0.
// Sources: Penner and Borshukov, "Pre-Integrated Skin Shading" (GPU Pro 2, 2011) for the ring; d'Eon and Luebke, "Advanced
// Techniques for Realistic Real-Time Skin Rendering" (GPU Gems 3, 2007) for the profile; Kelemen and Szirmay-Kalos, "A
// Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling" (2001) for the gloss; Bowling et al., "A
// Logistic Approximation to the Cumulative Normal Distribution" (2009) for Phi, to 2e-4.
#pragma once

#include "elementary.hpp"

namespace ringlet {

struct SkinLayer {
    float spread;    // sqrt(v) [m]
    float weight[3]; // of R, G, B
};

inline constexpr SkinLayer kSkinLayers[6] = {
    {0.080e-3f, {0.233f, 0.455f, 0.649f}}, {0.220e-3f, {0.100f, 0.336f, 0.344f}}, {0.432e-3f, {0.118f, 0.198f, 0.000f}},
    {0.753e-3f, {0.113f, 0.007f, 0.007f}}, {1.411e-3f, {0.358f, 0.004f, 0.000f}}, {2.722e-3f, {0.078f, 0.000f, 0.000f}}};

/// How far c may be below 0 where light still comes round: three of the widest layer's spreads.
inline constexpr float kSkinReach = 3 * 2.722e-3f;

/// The diffuse light E of a ring's point; max(c, 0) where it is flat.
RINGLET_INLINE Floats ring_light(Floats c, Floats s) {
    const Floats x = c / maximum<float>(s, splat(1e-6f)), square = minimum<float>(x * x, splat(80.0f));
    const Floats Phi = 1.0f / (1.0f + exponential(clamp(-x * (1.5976f + 0.07056f * square), -80, 80)));
    const Floats phi = 0.39894228f * exponential(-0.5f * square);
    const Floats round = exponential(-0.5f * s * s) * (c * Phi + s * phi);
    return s > 1e-4f ? maximum<float>(round, splat(0.0f)) : maximum<float>(c, splat(0.0f));
}

/// Diffuse light of R, G, B, as parts of the irradiance on a surface that faces the light.
RINGLET_INLINE void scattered(Floats c, Floats curvature, Floats light[3]) {
    for (int k = 0; k < 3; ++k) light[k] = splat(0.0f);
    for (const SkinLayer &layer : kSkinLayers) {
        const Floats E = ring_light(c, layer.spread * curvature);
        for (int k = 0; k < 3; ++k) light[k] += layer.weight[k] * E;
    }
}

/// Gloss times N.L for the cosines of the half vector with N and L, and the square of the half vector's length before it
/// is unit: Beckmann's roughness 0.3, Schlick's Fresnel at 2.8 %.
RINGLET_INLINE Floats gloss(Floats normal_half, Floats light_half, Floats square, Floats facing) {
    constexpr float roughness = 0.3f * 0.3f;
    const Floats n2 = maximum<float>(normal_half * normal_half, splat(1e-3f));
    const Floats slopes = exponential((n2 - 1.0f) / (n2 * roughness)) / (3.14159265f * roughness * n2 * n2);
    Floats miss = 1.0f - maximum<float>(light_half, splat(0.0f));
    miss = miss * (miss * miss) * (miss * miss);
    const Floats fresnel = 0.028f + 0.972f * miss;
    return normal_half > 0.0f ? facing * fresnel * slopes / maximum<float>(square, splat(1e-3f)) : splat(0.0f);
}

} // namespace ringlet
