// Vectors, colours and frames in single precision. A colour is a Vec3 of red, green and blue.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace oracle {

constexpr float pi = 3.14159265358979f;
constexpr float inv_pi = 1 / pi;

// As std::min and std::max, which pass references and so keep compilers from making vectors.
inline float smaller(float a, float b) { return b < a ? b : a; }
inline float larger(float a, float b) { return a < b ? b : a; }

struct Vec2 {
    float x, y;
};

struct Vec3 {
    float x, y, z;
};

using Color = Vec3;

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Vec3 operator*(float s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec3 operator*(const Vec3& a, float s) { return s * a; }
inline Vec3 operator/(const Vec3& a, float s) { return (1 / s) * a; }
inline Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }
inline Vec3& operator*=(Vec3& a, const Vec3& b) { return a = a * b; }
inline Vec3& operator*=(Vec3& a, float s) { return a = a * s; }

inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length_squared(const Vec3& a) { return dot(a, a); }
inline float length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalize(const Vec3& a) { return a / length(a); }
inline float max_component(const Vec3& a) { return larger(a.x, larger(a.y, a.z)); }
inline float largest(const Vec3& a) { return max_component({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}); }
inline bool is_black(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline float mean(const Color& c) { return (c.x + c.y + c.z) / 3; }
inline Color white() { return {1, 1, 1}; }
inline float squared(float x) { return x * x; }
inline float safe_sqrt(float x) { return std::sqrt(larger(x, 0.0f)); }

// An orthonormal basis around a normal, which becomes the z axis.
struct Frame {
    Vec3 x, y, z;

    // Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    explicit Frame(const Vec3& n) : z(n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1 / (sign + n.z), b = n.x * n.y * a;
        x = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
        y = {b, sign + n.y * n.y * a, -n.y};
    }

    Vec3 to_local(const Vec3& v) const { return {dot(v, x), dot(v, y), dot(v, z)}; }
    Vec3 to_world(const Vec3& v) const { return v.x * x + v.y * y + v.z * z; }
};

// Sine and cosine of an angle within [-pi/4, pi/4]; Taylor's polynomials reach the last bit of a float there.
inline void sine_cosine_of_octant(float a, float& sine, float& cosine) {
    const float q = a * a;
    sine = a * (1 + q * (-1.0f / 6 + q * (1.0f / 120 + q * (-1.0f / 5040 + q * (1.0f / 362880)))));
    cosine = 1 + q * (-0.5f + q * (1.0f / 24 + q * (-1.0f / 720 + q * (1.0f / 40320))));
}

// The same of any angle up to some hundred. Unlike the C library's these functions are the same everywhere, and compilers
// make vectors of them.
inline void sine_cosine(float a, float& sine, float& cosine) {
    const auto quarter = static_cast<int32_t>(a * (2 / pi) + std::copysign(0.5f, a));
    const auto k = static_cast<float>(quarter);
    float s, c;
    // pi/2 in three parts (Cody and Waite 1980).
    sine_cosine_of_octant(a - k * 1.5703125f - k * 4.83751297e-4f - k * 7.5497899549e-8f, s, c);
    const bool odd = quarter & 1;
    const float first = odd ? c : s, second = odd ? s : c;
    sine = quarter & 2 ? -first : first;
    cosine = (quarter + 1) & 2 ? -second : second;
}

// Angle of (x, y) in [-pi, pi], to some 1e-7 of itself; a Chebyshev fit of atan(q)/q in powers of q^2.
inline float arc_tangent(float y, float x) {
    const float u = std::fabs(x), v = std::fabs(y);
    const float large = larger(u, v), small = smaller(u, v);
    const float q = small / (large > 0 ? large : 1), q2 = q * q;
    const float high = (((0.0027662836f * q2 - 0.015731249f) * q2 + 0.042137624f) * q2 - 0.074568548f) * q2 + 0.10618371f;
    const float sum = (((high * q2 - 0.14197798f) * q2 + 0.19991872f) * q2 - 0.33333037f) * q2 + 1;
    float angle = q * sum;
    angle = v > u ? pi / 2 - angle : angle;
    angle = x < 0 ? pi - angle : angle;
    return std::copysign(angle, y);
}

// Uniform point of the unit disk; neighbours stay neighbours (Shirley and Chiu 1997).
inline Vec2 square_to_disk(const Vec2& u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool wide = std::fabs(a) > std::fabs(b);
    const float radius = wide ? a : b, other = wide ? b : a;
    float s, c;
    sine_cosine_of_octant(pi / 4 * (other / (radius == 0 ? 1 : radius)), s, c);
    return {radius * (wide ? c : s), radius * (wide ? s : c)};
}

// Density cos(theta) / pi.
inline Vec3 square_to_cosine_hemisphere(const Vec2& u) {
    const Vec2 p = square_to_disk(u);
    return {p.x, p.y, safe_sqrt(1 - p.x * p.x - p.y * p.y)};
}

// Density 1 / (2 pi): a point of the disk, bent to equal areas.
inline Vec3 square_to_hemisphere(const Vec2& u) {
    const Vec2 p = square_to_disk(u);
    const float r2 = p.x * p.x + p.y * p.y, bend = safe_sqrt(2 - r2);
    return {p.x * bend, p.y * bend, 1 - r2};
}

// Density 1 / (4 pi).
inline Vec3 square_to_sphere(const Vec2& u) {
    const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z), phi = 2 * pi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace oracle
