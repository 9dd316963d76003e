#include "render.h"

#include <chrono>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>

namespace oracle {
namespace {

constexpr int tile = 16;
// Larger than this a sample, in units of 2^exponent, is not added: its square would leave the range.
constexpr double largest_sample = 0x1p28;

void add(Sum& sum, double value, double unit) {
    __extension__ using Wide = __int128;
    const Wide before = (static_cast<Wide>(sum.high) << 64) | static_cast<Wide>(sum.low);
    const Wide after = before + static_cast<Wide>(value * unit);
    sum.low = static_cast<uint64_t>(after);
    sum.high = static_cast<int64_t>(after >> 64);
}

Defect::Kind defect_of(const Color& c, double scale) {
    for (const float v : {c.x, c.y, c.z}) {
        if (!std::isfinite(v)) return Defect::Kind::not_finite;
        if (v < 0) return Defect::Kind::negative;
        if (v * scale > largest_sample) return Defect::Kind::too_large;
    }
    return Defect::Kind::none;
}

// Shared by the threads of one pass.
struct Work {
    std::atomic<int> next{0};
    std::atomic<int> done{0};
    std::atomic<bool> stop{false};
    std::mutex mutex;
    std::condition_variable finished;
    int running = 0;
    Defect defect;
    std::exception_ptr failure;
};

}  // namespace

Defect render_pass(const Scene& scene, const Sensor& sensor, const Film& film, const Pass& pass, int threads, Sum* sums,
                   Sum* squares, const std::function<bool(double)>& watch) {
    const int columns = (film.width + tile - 1) / tile, rows = (film.height + tile - 1) / tile, tiles = columns * rows;
    const double scale = std::ldexp(1.0, -pass.exponent), unit = 0x1p64 * scale, square_unit = 0x1p60 * scale * scale;
    Work work;

    const auto render_pixel = [&](int x, int y) {
        const size_t pixel = size_t(y) * size_t(film.width) + size_t(x);
        for (uint32_t i = 0; i < pass.samples; ++i) {
            const uint32_t index = pass.first_sample + i;
            Sampler sampler(pass.sampler, pass.seed, uint32_t(pixel), index, pass.replicates);
            const Color c = measure(scene, sensor, film, pass.method, x, y, sampler);
            if (const auto kind = defect_of(c, scale); kind != Defect::Kind::none) {
                const std::lock_guard lock(work.mutex);
                work.defect = {kind, x, y, index};
                work.stop = true;
                return;
            }
            Sum* sum = sums + (pixel * pass.replicates + index % pass.replicates) * 3;
            Sum* square = squares + pixel * 3;
            const float channels[] = {c.x, c.y, c.z};
            for (int k = 0; k < 3; ++k) {
                add(sum[k], channels[k], unit);
                add(square[k], double(channels[k]) * channels[k], square_unit);
            }
        }
    };
    const auto run = [&] {
        try {
            for (int t; !work.stop && (t = work.next++) < tiles; ++work.done) {
                const int x0 = t % columns * tile, y0 = t / columns * tile;
                for (int y = y0; y < std::min(y0 + tile, film.height); ++y)
                    for (int x = x0; x < std::min(x0 + tile, film.width) && !work.stop; ++x) render_pixel(x, y);
            }
        } catch (...) {
            const std::lock_guard lock(work.mutex);
            work.failure = std::current_exception();
            work.stop = true;
        }
        const std::lock_guard lock(work.mutex);
        if (--work.running == 0) work.finished.notify_one();
    };

    std::vector<std::thread> crew;
    if (threads == 0) threads = std::max(1, int(std::thread::hardware_concurrency()));
    work.running = std::min(threads, tiles);
    for (int i = 0, count = work.running; i < count; ++i) crew.emplace_back(run);
    {
        std::unique_lock lock(work.mutex);
        while (!work.finished.wait_for(lock, std::chrono::milliseconds(50), [&] { return work.running == 0; })) {
            lock.unlock();
            if (!watch(double(work.done) / tiles)) work.stop = true;
            lock.lock();
        }
    }
    for (std::thread& thread : crew) thread.join();
    if (work.failure) std::rethrow_exception(work.failure);
    return work.defect;
}

std::vector<FirstHit> first_hits(const Scene& scene, const Sensor& sensor, const Film& film) {
    std::vector<FirstHit> result;
    result.reserve(size_t(film.width) * size_t(film.height));
    for (int y = 0; y < film.height; ++y) {
        for (int x = 0; x < film.width; ++x) {
            const Vec2 center{(float(x) + 0.5f) / float(film.width), (float(y) + 0.5f) / float(film.height)};
            const Ray ray = sensor_ray(sensor, center);
            Surface s{};
            if (!scene.intersect(ray, s)) {
                result.push_back({std::numeric_limits<float>::infinity(), {}, {}, {}, -1});
                continue;
            }
            int material = std::max(s.material, 0);
            if (const Material& m = scene.materials[size_t(material)]; m.kind == Material::Kind::two_sided)
                material = dot(s.shading, ray.direction) < 0 ? m.first : m.second;
            result.push_back({s.distance, s.p, s.shading, scene.bsdf(s, material).albedo(), int64_t(s.object)});
        }
    }
    return result;
}

}  // namespace oracle
