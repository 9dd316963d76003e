// Whole images: samples of pixels, on any number of threads, added up so that the order does not matter.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "integrator.h"

namespace oracle {

// A sum of many small numbers as an integer of 128 bits in units of 2^-64: exact, hence independent of the order.
struct Sum {
    uint64_t low;
    int64_t high;
};
static_assert(sizeof(Sum) == 16);

struct Pass {
    Method method;
    SamplerKind sampler;
    uint64_t seed;
    uint32_t first_sample, samples;
    uint32_t replicates;  // by which sums are kept apart, for the variance of dependent samples
    int exponent;         // samples are divided by 2^exponent before they are added up
};

// What went wrong with samples; the image is worthless then.
struct Defect {
    enum class Kind { none, not_finite, negative, too_large };
    Kind kind = Kind::none;
    int x = 0, y = 0;
    uint32_t sample = 0;
};

// Adds a pass to `sums`, (height, width, replicates, 3), and the samples' squares to `squares`, (height, width, 3).
// 0 threads are one for each processor.
// `watch` is called now and then by the calling thread with the part that is done; if it returns false, or a sample is
// defective, the rest is left out and the sums are incomplete.
Defect render_pass(const Scene& scene, const Sensor& sensor, const Film& film, const Pass& pass, int threads, Sum* sums,
                   Sum* squares, const std::function<bool(double)>& watch);

// What the rays through the pixels' centers meet, pixel by pixel.
struct FirstHit {
    float distance;  // infinity for nothing
    Vec3 position, normal;
    Color albedo;
    int64_t object;  // -1 for nothing
};
std::vector<FirstHit> first_hits(const Scene& scene, const Sensor& sensor, const Film& film);

}  // namespace oracle
