// Facets with the GGX distribution of slopes and Smith's shadowing (Walter et al. 2007; Heitz 2014).
// Directions are local, the macroscopic normal is z.
#pragma once

#include "vec.h"

namespace oracle {

struct Ggx {
    float alpha;
    bool separable;  // masking and shadowing independent of each other, instead of correlated by height

    float density(const Vec3& m) const {
        if (m.z <= 0) return 0;
        const float a2 = alpha * alpha, c2 = m.z * m.z;
        // 1 - c2 loses the digits of near-normal facets; x^2 + y^2 keeps them.
        const float d = c2 * a2 + (m.x * m.x + m.y * m.y);
        return a2 / (pi * d * d);
    }

    // Smith's Lambda; G1 = 1 / (1 + Lambda).
    float lambda(const Vec3& w) const {
        const float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
        return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
    }

    float g1(const Vec3& w) const { return 1 / (1 + lambda(w)); }

    // Masking and shadowing together; both directions may be on either side.
    float g2(const Vec3& a, const Vec3& b) const { return separable ? g1(a) * g1(b) : 1 / (1 + lambda(a) + lambda(b)); }

    // A facet's normal with the density of those that `w` (w.z > 0) sees (Dupuy and Benyoub 2023).
    Vec3 sample_visible(const Vec3& w, const Vec2& u) const {
        const Vec3 stretched = normalize({alpha * w.x, alpha * w.y, w.z});
        const float phi = 2 * pi * u.x;
        const float z = (1 - u.y) * (1 + stretched.z) - stretched.z;
        const float r = safe_sqrt(1 - z * z);
        const Vec3 h = Vec3{r * std::cos(phi), r * std::sin(phi), z} + stretched;
        return normalize({alpha * h.x, alpha * h.y, std::max(h.z, 0.0f)});
    }

    // Density of the facets m (m.z > 0) that `w` sees, from the side on which it is.
    float visible_density(const Vec3& w, const Vec3& m) const {
        return g1(w) * std::fabs(dot(w, m) / w.z) * density(m);
    }
};

}  // namespace oracle
