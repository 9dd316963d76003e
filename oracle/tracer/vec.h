// Vectors, colours and frames in single precision. A colour is a Vec3 of red, green and blue.
#pragma once

#include <algorithm>
#include <cmath>

namespace oracle {

constexpr float pi = 3.14159265358979f;
constexpr float inv_pi = 1 / pi;

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
inline float max_component(const Vec3& a) { return std::max({a.x, a.y, a.z}); }
inline float largest(const Vec3& a) { return std::max({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}); }
inline bool is_black(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline float mean(const Color& c) { return (c.x + c.y + c.z) / 3; }
inline Color white() { return {1, 1, 1}; }
inline float squared(float x) { return x * x; }
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }

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

// Uniform point of the unit disk; neighbours stay neighbours (Shirley and Chiu 1997).
inline Vec2 square_to_disk(const Vec2& u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    if (a == 0 && b == 0) return {0, 0};
    float s, c;
    if (std::fabs(a) > std::fabs(b)) {
        sine_cosine_of_octant(pi / 4 * (b / a), s, c);
        return {a * c, a * s};
    }
    sine_cosine_of_octant(pi / 4 * (a / b), s, c);
    return {b * s, b * c};
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
