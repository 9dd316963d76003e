#include "render.h"

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <limits>
#include <mutex>
#include <thread>

namespace oracle {
namespace {

constexpr int tile = 16;
// Larger than this a sample, in units of 2^exponent, is not added: its square would leave the range.
constexpr double largest_sample = 0x1p28;

// Adds a value in [0, 2^60) times 2^`shift`, rounded down to an integer; `shift` is between 1 and 64.
inline void add(Sum& sum, double value, int shift) {
    // A double is the sum of its whole part and the rest, exactly.
    const auto whole = static_cast<int64_t>(value);
    const auto rest = static_cast<uint64_t>((value - static_cast<double>(whole)) * (shift == 64 ? 0x1p64 : static_cast<double>(uint64_t{1} << shift)));
    const uint64_t low = shift == 64 ? rest : rest | static_cast<uint64_t>(whole) << shift;
    sum.low += low;
    sum.high += (shift == 64 ? whole : whole >> (64 - shift)) + (sum.low < low);
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
    const double scale = std::ldexp(1.0, -pass.exponent);
    Work work;

    const auto render_pixel = [&](int x, int y) {
        const size_t pixel = size_t(y) * size_t(film.width) + size_t(x);
        Sum* square = squares + pixel * 3;
        for (uint32_t done = 0; done < pass.samples; done += batch) {
            const uint32_t first = pass.first_sample + done;
            const int count = int(std::min<uint32_t>(batch, pass.samples - done));
            const Sampler sampler(pass.sampler, pass.seed, uint32_t(pixel), first, count, pass.replicates);
            Color results[batch];
            measure(scene, sensor, film, pass.method, x, y, sampler, count, results);
            for (int i = 0; i < count; ++i) {
                const Color& c = results[i];
                const uint32_t index = first + uint32_t(i);
                if (const auto kind = defect_of(c, scale); kind != Defect::Kind::none) {
                    const std::lock_guard lock(work.mutex);
                    work.defect = {kind, x, y, index};
                    work.stop = true;
                    return;
                }
                Sum* sum = sums + (pixel * pass.replicates + index % pass.replicates) * 3;
                const double channels[] = {c.x * scale, c.y * scale, c.z * scale};
                for (int k = 0; k < 3; ++k) {
                    add(sum[k], channels[k], 64);
                    add(square[k], channels[k] * channels[k], 60);
                }
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
