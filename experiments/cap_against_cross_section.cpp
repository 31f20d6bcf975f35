// The listings of dupuy2023 as they stand (line 8 of listing 1 corrected), in float32: nanoseconds a sample of the cap
// (listing 3) and of the cross-section (listing 2), interleaved, best of 401 runs. One thread.
//
//   g++ -O3 -march=native cap_against_cross_section.cpp -o listings && ./listings

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

struct Vec {
    float x, y, z;
};

static Vec scale(Vec a, float s) { return {a.x * s, a.y * s, a.z * s}; }
static Vec add(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec normalise(Vec a) { return scale(a, 1 / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z)); }
static Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

static const float PI = 3.14159265358979f;

// Listing 3: a direction of the cap, half vector with wi.
static Vec cap(float u0, float u1, Vec wi) {
    float phi = 2 * PI * u0;
    float z = (1 - u1) * (1 + wi.z) - wi.z;
    float s = std::sqrt(std::min(std::max(1 - z * z, 0.0f), 1.0f));
    return add({s * std::cos(phi), s * std::sin(phi), z}, wi);
}

// Listing 2: a point of the cross-section, projected back to the hemisphere.
static Vec cross_section(float u0, float u1, Vec wi) {
    float flat = wi.x * wi.x + wi.y * wi.y;
    Vec w1 = flat > 0 ? scale({-wi.y, wi.x, 0}, 1 / std::sqrt(flat)) : Vec{1, 0, 0};
    Vec w2 = cross(wi, w1);
    float phi = 2 * PI * u0, r = std::sqrt(u1);
    float t1 = r * std::cos(phi), t2 = r * std::sin(phi), s = 0.5f * (1 + wi.z);
    t2 = (1 - s) * std::sqrt(1 - t1 * t1) + s * t2;
    float t3 = std::sqrt(std::max(0.0f, 1 - t1 * t1 - t2 * t2));
    return add(add(scale(w1, t1), scale(w2, t2)), scale(wi, t3));
}

// Listing 1: stretch, sample the hemisphere, unstretch.
template <Vec (*Hemisphere)(float, float, Vec)> static Vec sample(float u0, float u1, Vec wi, float ax, float ay) {
    Vec m = Hemisphere(u0, u1, normalise({ax * wi.x, ay * wi.y, wi.z}));
    return normalise({ax * m.x, ay * m.y, m.z});
}

struct Inputs {
    std::vector<float> u0, u1;
    std::vector<Vec> wi;
};

template <Vec (*Hemisphere)(float, float, Vec)> static double run(const Inputs &in, std::vector<Vec> &out) {
    auto start = std::chrono::steady_clock::now();
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = sample<Hemisphere>(in.u0[i], in.u1[i], in.wi[i], 0.3f, 0.1f);
    std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
    return spent.count() / out.size();
}

// The fastest of many short runs: what the machine's other work disturbs least.
static double best(const std::vector<double> &t) { return *std::min_element(t.begin(), t.end()); }

int main() {
    const size_t n = 1 << 13;
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    Inputs in;
    for (size_t i = 0; i < n; ++i) {
        float z = 0.02f + 0.98f * uniform(generator), phi = 2 * PI * uniform(generator), s = std::sqrt(1 - z * z);
        in.u0.push_back(uniform(generator));
        in.u1.push_back(uniform(generator));
        in.wi.push_back({s * std::cos(phi), s * std::sin(phi), z});
    }
    std::vector<Vec> out(n);
    std::vector<double> caps, crosses;
    double check = 0;
    for (int k = 0; k < 401; ++k) {
        caps.push_back(run<cap>(in, out));
        check += out[k].z;
        crosses.push_back(run<cross_section>(in, out));
        check += out[k].z;
    }
    double a = best(caps), b = best(crosses);
    std::printf("{\"cap_ns\": %.3f, \"cross_section_ns\": %.3f, \"ratio\": %.3f, \"check\": %.6f}\n", a, b, b / a, check);
}
