// Few surfaces: what eight rays find side by side, screened in single precision, against the search in double precision.
// Scenes of all sizes and distances from the origin, with surfaces that all but coincide; rays from anywhere and from
// surfaces, to anywhere, to edges, and parallel to surfaces.
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

#include "few.h"

using namespace oracle;

int main() {
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    const auto u = [&] { return uniform(generator); };
    const auto within = [&](float size) {
        const float x = size * (u() - 0.5f), y = size * (u() - 0.5f), z = size * (u() - 0.5f);
        return Vec3{x, y, z};
    };
    const auto along = [](int axis, float length) {
        return Vec3{axis == 0 ? length : 0, axis == 1 ? length : 0, axis == 2 ? length : 0};
    };
    long rays = 0, hits = 0, blocked = 0, different = 0;
    for (int scene = 0; scene < 200; ++scene) {
        Few few;
        const float size = std::pow(10.0f, 6 * u() - 3);
        const Vec3 middle = within(scene % 3 == 0 ? 0 : size * std::pow(10.0f, 3 * u()));
        const auto count = size_t(1 + 60 * u());
        std::vector<std::pair<Vec3, Vec3>> edges;
        for (int i = 0; few.size() < count; ++i) {
            const bool upright = scene % 2 == 0;
            const Vec3 a = middle + within(size);
            const Vec3 b = a + (upright ? along(i % 3, size * u()) : within(size));
            const Vec3 c = a + (upright ? along((i + 1) % 3, size * u()) : within(size));
            // A quad cut into two triangles, one of them alone, or a parallelogram.
            const Vec3 d = b + (c - a);
            few.add(a, b, i % 3 == 2 ? c : d, i % 3 == 2);
            if (i % 3 == 0) few.add(a, d, c, false);
            if (i % 3 == 1) few.add(a + within(1e-6f * size), b, d, false);
            edges.push_back({a, b});
        }
        for (int repetition = 0; repetition < 400; ++repetition) {
            Few::Rays eight;
            for (int k = 0; k < Few::side_by_side; ++k) {
                Vec3 origin = middle + within(size), direction = normalize(within(1));
                const auto& [from, to] = edges[size_t(float(edges.size()) * u()) % edges.size()];
                const float choice = u();
                if (choice < 0.2f)
                    direction = along(int(3 * u()), u() < 0.5f ? 1.0f : -1.0f);
                else if (choice < 0.6f)
                    direction = normalize(from + u() * (to - from) - origin);
                int begin = Few::none;
                const Few::Hit start = few.closest(origin, direction, std::numeric_limits<double>::infinity());
                if (start.index != Few::none && u() < 0.5f) {
                    // From beside the surface on.
                    const Vec3 back = -direction;
                    const auto distance = float(start.distance);
                    origin = origin + distance * direction;
                    origin += 2e-6f * std::max(largest(origin), distance) * back;
                    direction = normalize(back + 0.9f * normalize(within(1)));
                    begin = few.screen_of(start.index);
                }
                // Limits are anywhere, or where the hit is.
                const Few::Hit next = few.closest(origin, direction, std::numeric_limits<double>::infinity());
                const bool exactly = next.index != Few::none && u() < 0.3f;
                eight.set(k, origin, direction, exactly ? float(next.distance) : size * u(), begin, Few::none);
            }
            Few::Hit found[Few::side_by_side];
            bool is_blocked[Few::side_by_side];
            few.closest(eight, found);
            few.blocked(eight, is_blocked);
            for (int k = 0; k < Few::side_by_side; ++k) {
                const Few::Hit truth = few.closest(eight.origin(k), eight.direction(k), std::numeric_limits<double>::infinity());
                const bool returns = truth.index != Few::none && few.screen_of(truth.index) == eight.begin[k];
                if (returns) continue;  // rounding has put the origin behind the surface
                ++rays, hits += truth.index != Few::none, blocked += is_blocked[k];
                different += truth.index != found[k].index || truth.distance != found[k].distance;
                different += (truth.distance < double(eight.limit[k])) != is_blocked[k];
            }
        }
    }
    std::printf("%ld rays, %ld hits, %ld blocked, %ld different\n", rays, hits, blocked, different);
    return different > 0 || hits < rays / 5 || blocked < rays / 10;
}
