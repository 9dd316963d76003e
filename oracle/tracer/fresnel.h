// Reflectance of smooth interfaces for unpolarised light (Fresnel 1823; Born and Wolf 1999, 1.5.2 and 14.2).
#pragma once

#include "vec.h"

namespace oracle {

// Reflectance of a dielectric; `eta` is the index on the other side divided by that on the side of the ray, `cosine` the
// ray's, at least 0. Gives the cosine of the refracted ray, 0 under total reflection.
inline float dielectric_reflectance(float cosine, float eta, float& cosine_refracted) {
    const float sine2 = (1 - cosine * cosine) / (eta * eta);
    cosine_refracted = 0;
    if (sine2 >= 1) return 1;
    const float c = cosine_refracted = std::sqrt(1 - sine2);
    const float s = (cosine - eta * c) / (cosine + eta * c), p = (eta * cosine - c) / (eta * cosine + c);
    return 0.5f * (s * s + p * p);
}

// Reflectance of a metal with the complex index eta + i k, in one channel.
inline float conductor_reflectance(float cosine, float eta, float k) {
    const float c2 = cosine * cosine, s2 = 1 - c2;
    const float t = eta * eta - k * k - s2;
    const float a2_b2 = std::sqrt(t * t + 4 * eta * eta * k * k);
    const float a = safe_sqrt(0.5f * (a2_b2 + t));
    const float s = (a2_b2 + c2 - 2 * a * cosine) / (a2_b2 + c2 + 2 * a * cosine);
    const float p = s * (c2 * a2_b2 + s2 * s2 - 2 * a * cosine * s2) / (c2 * a2_b2 + s2 * s2 + 2 * a * cosine * s2);
    return 0.5f * (s + p);
}

inline Color conductor_reflectance(float cosine, const Color& eta, const Color& k) {
    return {conductor_reflectance(cosine, eta.x, k.x), conductor_reflectance(cosine, eta.y, k.y),
            conductor_reflectance(cosine, eta.z, k.z)};
}

}  // namespace oracle
