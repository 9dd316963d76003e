// Colours that may vary over a surface.
#pragma once

#include <cstdint>
#include <vector>

#include "vec.h"

namespace oracle {

struct Texture {
    enum class Kind { bitmap, checker };
    Kind kind;

    // A bitmap: texels row by row from the top, repeated over the plane.
    int width = 0, height = 0;
    bool smooth = true;
    std::vector<Color> texels;

    // A checker: so many fields for u and v from 0 to 1.
    Color even{}, odd{};
    float columns = 0, rows = 0;

    Color at(const Vec2& uv) const {
        if (kind == Kind::checker) {
            const auto i = static_cast<int64_t>(std::floor(uv.x * columns));
            const auto j = static_cast<int64_t>(std::floor(uv.y * rows));
            return (i + j) % 2 == 0 ? even : odd;
        }
        const float x = uv.x * static_cast<float>(width), y = (1 - uv.y) * static_cast<float>(height);
        if (!smooth) return texel(std::floor(x), std::floor(y));
        const float x0 = std::floor(x - 0.5f), y0 = std::floor(y - 0.5f);
        const float fx = x - 0.5f - x0, fy = y - 0.5f - y0;
        return (1 - fy) * ((1 - fx) * texel(x0, y0) + fx * texel(x0 + 1, y0)) +
               fy * ((1 - fx) * texel(x0, y0 + 1) + fx * texel(x0 + 1, y0 + 1));
    }

    Color average() const {
        if (kind == Kind::checker) return 0.5f * (even + odd);
        double sum[3] = {};
        for (const Color& c : texels) sum[0] += c.x, sum[1] += c.y, sum[2] += c.z;
        const auto count = static_cast<double>(texels.size());
        return {float(sum[0] / count), float(sum[1] / count), float(sum[2] / count)};
    }

private:
    const Color& texel(float x, float y) const {
        const auto wrap = [](float i, int n) {
            const auto r = static_cast<int>(static_cast<int64_t>(i) % n);
            return r < 0 ? r + n : r;
        };
        return texels[size_t(wrap(y, height)) * size_t(width) + size_t(wrap(x, width))];
    }
};

// A constant colour, or the index of a texture.
struct ColorMap {
    Color constant{};
    int texture = -1;

    Color at(const std::vector<Texture>& textures, const Vec2& uv) const {
        return texture < 0 ? constant : textures[size_t(texture)].at(uv);
    }
};

}  // namespace oracle
