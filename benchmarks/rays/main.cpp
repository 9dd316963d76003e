// How much of the tracer's time goes to Embree: rays per second while rendering, against a bare loop that sends the very
// same rays through Embree again. Linked with --wrap, so that the tracer's own calls can be recorded.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "render.h"

using namespace oracle;

namespace {

struct Recorded {
    RTCRay ray;
    bool occlusion;
};
std::vector<Recorded>* recorder = nullptr;

void note(const RTCRay& ray, bool occlusion) {
    if (recorder) recorder->push_back({ray, occlusion});
}

template <typename Rays>
void note(const int* valid, const Rays& rays, bool occlusion) {
    for (int k = 0; recorder && k < 8; ++k) {
        if (!valid[k]) continue;
        RTCRay ray{};
        ray.org_x = rays.org_x[k], ray.org_y = rays.org_y[k], ray.org_z = rays.org_z[k];
        ray.dir_x = rays.dir_x[k], ray.dir_y = rays.dir_y[k], ray.dir_z = rays.dir_z[k];
        ray.tfar = rays.tfar[k];
        ray.mask = ~0u;
        note(ray, occlusion);
    }
}

// CPU time of the whole process: what else runs on the machine counts less than it would on the clock.
double now() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace

extern "C" {
#if ORACLE_EMBREE_MAJOR >= 4
void __real_rtcIntersect1(RTCScene, RTCRayHit*, RTCIntersectArguments*);
void __real_rtcOccluded1(RTCScene, RTCRay*, RTCOccludedArguments*);
void __wrap_rtcIntersect1(RTCScene s, RTCRayHit* q, RTCIntersectArguments* a) {
    note(q->ray, false);
    __real_rtcIntersect1(s, q, a);
}
void __wrap_rtcOccluded1(RTCScene s, RTCRay* q, RTCOccludedArguments* a) {
    note(*q, true);
    __real_rtcOccluded1(s, q, a);
}
void __real_rtcIntersect8(const int*, RTCScene, RTCRayHit8*, RTCIntersectArguments*);
void __real_rtcOccluded8(const int*, RTCScene, RTCRay8*, RTCOccludedArguments*);
void __wrap_rtcIntersect8(const int* v, RTCScene s, RTCRayHit8* q, RTCIntersectArguments* a) {
    note(v, q->ray, false);
    __real_rtcIntersect8(v, s, q, a);
}
void __wrap_rtcOccluded8(const int* v, RTCScene s, RTCRay8* q, RTCOccludedArguments* a) {
    note(v, *q, true);
    __real_rtcOccluded8(v, s, q, a);
}
#else
void __real_rtcIntersect1(RTCScene, RTCIntersectContext*, RTCRayHit*);
void __real_rtcOccluded1(RTCScene, RTCIntersectContext*, RTCRay*);
void __wrap_rtcIntersect1(RTCScene s, RTCIntersectContext* c, RTCRayHit* q) {
    note(q->ray, false);
    __real_rtcIntersect1(s, c, q);
}
void __wrap_rtcOccluded1(RTCScene s, RTCIntersectContext* c, RTCRay* q) {
    note(*q, true);
    __real_rtcOccluded1(s, c, q);
}
void __real_rtcIntersect8(const int*, RTCScene, RTCIntersectContext*, RTCRayHit8*);
void __real_rtcOccluded8(const int*, RTCScene, RTCIntersectContext*, RTCRay8*);
void __wrap_rtcIntersect8(const int* v, RTCScene s, RTCIntersectContext* c, RTCRayHit8* q) {
    note(v, q->ray, false);
    __real_rtcIntersect8(v, s, c, q);
}
void __wrap_rtcOccluded8(const int* v, RTCScene s, RTCIntersectContext* c, RTCRay8* q) {
    note(v, *q, true);
    __real_rtcOccluded8(v, s, c, q);
}
#endif
}

namespace {

// A quad as two triangles, cut into n x n and bent a little if n > 1.
void quad(Mesh& mesh, const Vec3& o, const Vec3& a, const Vec3& b, int n) {
    const Vec3 normal = normalize(cross(a, b));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const auto base = uint32_t(mesh.vertices.size());
            const auto corner = [&](int k, int l) {
                const float u = float(k) / float(n), v = float(l) / float(n);
                const float bump = n > 1 ? 0.003f * std::sin(40 * u) * std::sin(37 * v) : 0;
                mesh.vertices.push_back(o + u * a + v * b + bump * normal);
            };
            corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1);
            mesh.triangles.push_back({base, base + 1, base + 2});
            mesh.triangles.push_back({base, base + 2, base + 3});
        }
}

void block(Mesh& mesh, const Vec3& corner, float width, float height, float angle, int n) {
    const Vec3 x{width * std::cos(angle), width * std::sin(angle), 0}, y{-x.y, x.x, 0}, z{0, 0, height};
    quad(mesh, corner + z, x, y, n);
    quad(mesh, corner, x, z, n);
    quad(mesh, corner + x, y, z, n);
    quad(mesh, corner + x + y, -x, z, n);
    quad(mesh, corner + y, -y, z, n);
    quad(mesh, corner, y, x, n);
}

// The box at Cornell, in metres and proportions of our own: 36 triangles for n = 1.
void cornell(Scene& scene, int n, bool hierarchy) {
    const auto material = [&](const Color& c) {
        Material m;
        m.kind = Material::Kind::diffuse;
        m.reflectance.constant = c;
        const int front = scene.add_material(m);
        Material sides;
        sides.kind = Material::Kind::two_sided;
        sides.first = sides.second = front;
        return scene.add_material(sides);
    };
    const auto add = [&](int m, Mesh mesh, const Color& radiance = {}) {
        Object o;
        o.material = m, o.emits = !is_black(radiance), o.radiance.constant = radiance;
        scene.add_mesh(scene.add_object(o), std::move(mesh));
    };
    const int white = material({0.7f, 0.7f, 0.7f}), red = material({0.6f, 0.1f, 0.1f}), green = material({0.1f, 0.5f, 0.1f});
    Mesh room, left, right, lamp;
    quad(room, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, n);
    quad(room, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, n);
    quad(room, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, n);
    block(room, {0.25f, 0.55f, 0}, 0.3f, 0.6f, 0.3f, n);
    block(room, {0.5f, 0.2f, 0}, 0.3f, 0.3f, -0.3f, n);
    quad(left, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, n);
    quad(right, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}, n);
    quad(lamp, {0.38f, 0.38f, 0.999f}, {0, 0.24f, 0}, {0.24f, 0, 0}, 1);
    add(white, std::move(room));
    add(red, std::move(left));
    add(green, std::move(right));
    add(-1, std::move(lamp), {18, 15, 10});
    scene.commit(hierarchy);
}

// CPU seconds of one image.
double render(const Scene& scene, const Sensor& sensor, const Film& film, uint32_t spp, int threads) {
    std::vector<Sum> sums(size_t(film.width) * size_t(film.height) * 3 * 8), squares(size_t(film.width) * size_t(film.height) * 3);
    const Pass pass{{Strategy::mis, 0, 7}, SamplerKind::sobol, 1, 0, spp, 8, 5};
    const double start = now();
    render_pass(scene, sensor, film, pass, threads, sums.data(), squares.data(), [](double) { return true; });
    return now() - start;
}

}  // namespace

int main(int argc, char** argv) {
    const int n = argc > 1 ? std::atoi(argv[1]) : 1, size = argc > 2 ? std::atoi(argv[2]) : 64;
    Scene scene, recorded;
    cornell(scene, n, false);
    cornell(recorded, n, true);
    const size_t triangles = size_t(n) * size_t(n) * 34 + 2;
    const Sensor sensor{Sensor::Kind::perspective, {0.5f, -1.4f, 0.5f}, {0, 1, 0}, {0.72f, 0, 0}, {0, 0, -0.72f}};
    const Film film{size, size, 0};
    constexpr uint32_t spp = 64;

    // Record once, on this thread.
    std::vector<Recorded> rays;
    recorder = &rays;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            for (uint32_t first = 0; first < spp; first += batch) {
                Color results[batch];
                const Sampler sampler(SamplerKind::sobol, 1, uint32_t(y * size + x), first, batch, 8);
                measure(recorded, sensor, film, {Strategy::mis, 0, 7}, x, y, sampler, batch, results);
            }
        }
    recorder = nullptr;
    size_t occlusions = 0;
    for (const Recorded& r : rays) occlusions += r.occlusion;

    std::printf("%zu triangles, %dx%d, depth 8, %.2f rays a path (%.0f %% of them to lights)\n", triangles, size, size,
                double(rays.size()) / (double(size) * size * spp), 100.0 * double(occlusions) / double(rays.size()));
    double best_ratio = 0, sum_ratio = 0;
    const int repetitions = 7;
    for (int k = 0; k < repetitions; ++k) {
        const double ours = render(scene, sensor, film, spp, 1);
        const double start = now();
        int hits = 0;
        for (const Recorded& r : rays) {
            if (r.occlusion) {
                RTCRay ray = r.ray;
                any_hit(recorded.embree(), ray);
                hits += ray.tfar < 0;
            } else {
                RTCRayHit query;
                query.ray = r.ray;
                query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
                closest_hit(recorded.embree(), query);
                hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            }
        }
        const double bare = now() - start;
        const double ratio = bare / ours;
        best_ratio = std::max(best_ratio, ratio), sum_ratio += ratio;
        std::printf("  tracer %6.2f M rays/s (%.0f ns each), bare Embree %6.2f M rays/s: %5.1f %%  [%d hits]\n",
                    double(rays.size()) / ours / 1e6, ours / double(rays.size()) * 1e9,
                    double(rays.size()) / bare / 1e6, 100 * ratio, hits);
    }
    std::printf("  mean %.1f %%, best %.1f %%\n", 100 * sum_ratio / repetitions, 100 * best_ratio);
}
