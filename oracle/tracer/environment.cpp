#include "environment.h"

namespace oracle {
namespace {

// The first index whose cumulated part exceeds u; u becomes uniform within it. The last entry of the table is 1.
size_t pick(const float* cdf, size_t count, float& u) {
    const size_t i = std::min<size_t>(size_t(std::upper_bound(cdf, cdf + count, u) - cdf), count - 1);
    const float before = i ? cdf[i - 1] : 0;
    u = std::min((u - before) / (cdf[i] - before), 0x1.fffffep-1f);
    return i;
}

void cumulate(const std::vector<double>& weights, float* cdf) {
    double sum = 0, total = 0;
    for (const double w : weights) total += w;
    for (size_t i = 0; i < weights.size(); ++i) {
        sum += weights[i];
        cdf[i] = total > 0 ? static_cast<float>(sum / total) : static_cast<float>(i + 1) / static_cast<float>(weights.size());
    }
    cdf[weights.size() - 1] = 1;
}

}  // namespace

Color Environment::radiance(const Vec3& w) const {
    switch (kind) {
        case Kind::none: return {};
        case Kind::constant: return horizon;
        case Kind::sky: {
            const float sine = dot(w, up);
            return sine <= 0 ? Color{} : horizon + sine * (zenith - horizon);
        }
        case Kind::map: return texels[texel_at(w)];
    }
    return {};
}

size_t Environment::texel_at(const Vec3& w) const {
    const float theta = std::atan2(length(cross(w, up)), dot(w, up));
    float phi = std::atan2(dot(w, left), dot(w, front)) / (2 * pi);
    if (phi < 0) phi += 1;
    const auto row = std::min(int(theta * inv_pi * float(height)), height - 1);
    const auto column = std::min(int(phi * float(width)), width - 1);
    return size_t(row) * size_t(width) + size_t(column);
}

float Environment::texel_solid_angle(size_t row) const {
    const double step = 3.14159265358979323846 / height;
    // cos(a) - cos(a + step), without cancellation.
    return static_cast<float>(2 * std::sin((double(row) + 0.5) * step) * std::sin(step / 2) * 2 * 3.14159265358979323846 /
                              width);
}

void Environment::build() {
    if (kind != Kind::map) return;
    const auto rows = size_t(height), columns = size_t(width);
    row_cdf_.resize(rows);
    column_cdf_.resize(rows * columns);
    std::vector<double> row_power(rows), power(columns);
    for (size_t r = 0; r < rows; ++r) {
        row_power[r] = 0;
        for (size_t c = 0; c < columns; ++c) row_power[r] += power[c] = mean(texels[r * columns + c]);
        row_power[r] *= texel_solid_angle(r);
        cumulate(power, &column_cdf_[r * columns]);
    }
    cumulate(row_power, row_cdf_.data());
}

Vec3 Environment::sample(Vec2 u, float& density) const {
    if (kind != Kind::map) {
        density = inv_pi / 4;
        return square_to_sphere(u);
    }
    const size_t r = pick(row_cdf_.data(), size_t(height), u.x);
    const size_t c = pick(&column_cdf_[r * size_t(width)], size_t(width), u.y);
    // Uniform in solid angle within the texel: linear in the cosine of the polar angle.
    const float step = pi / float(height);
    const float high = std::cos(float(r) * step), low = std::cos(float(r + 1) * step);
    const float z = high + u.x * (low - high), radius = safe_sqrt(1 - z * z);
    const float phi = 2 * pi * (float(c) + u.y) / float(width);
    const Vec3 w = z * up + radius * (std::cos(phi) * front + std::sin(phi) * left);
    density = pdf(w);
    return w;
}

float Environment::pdf(const Vec3& w) const {
    if (kind != Kind::map) return inv_pi / 4;
    const size_t texel = texel_at(w), r = texel / size_t(width), c = texel % size_t(width);
    const float in_row = column_cdf_[texel] - (c ? column_cdf_[texel - 1] : 0);
    return (row_cdf_[r] - (r ? row_cdf_[r - 1] : 0)) * in_row / texel_solid_angle(r);
}

Color Environment::mean_radiance() const {
    switch (kind) {
        case Kind::none: return {};
        case Kind::constant: return horizon;
        case Kind::sky: return 0.25f * (horizon + zenith);
        case Kind::map: break;
    }
    Vec3 sum{};
    for (size_t i = 0; i < texels.size(); ++i) sum += texel_solid_angle(i / size_t(width)) * texels[i];
    return sum / (4 * pi);
}

}  // namespace oracle
