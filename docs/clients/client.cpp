// A client of ggxref's vectors in C++17, without dependencies: your formulas against
//   c++ -O2 -std=c++17 -o client client.cpp
//   ggxref grade --command ./client --functions ndf.ggx,masking.g1_ggx,sampling.spherical_cap.pdf --dtypes f32,f64
// Questions come on standard input, a header and then a line a test; answers go to standard output.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

// ---- The formulas under test: put your own here. ----

// D of GGX at a unit micronormal m: a sum of squares, as 1 - cos^2 has no digits left near the normal.
template <class T> T ggx(const T* m, const T* alpha) {
    if (!(m[2] > 0)) return 0;
    const T x = m[0] / alpha[0], y = m[1] / alpha[1], q = x * x + y * y + m[2] * m[2];
    return 1 / (T(3.14159265358979323846) * (alpha[0] * q) * (alpha[1] * q));
}

template <class T> T length(T x, T y, T z) { return std::sqrt(x * x + y * y + z * z); }

// a.b in twice the precision: the plain sum cancels where the vectors are nearly perpendicular.
template <class T> T dot(const T* a, const T* b) {
    T sum = 0, rest = 0;
    for (int i = 0; i < 3; i++) {
        const T p = a[i] * b[i], s = sum + p, t = s - sum;
        rest += std::fma(a[i], b[i], -p) + ((sum - (s - t)) + (p - t));
        sum = s;
    }
    return sum + rest;
}

template <class T> T g1(const T* w, const T* m, const T* alpha) {
    const T c = dot(w, m), z = std::fabs(w[2]);
    if (!((c > 0 && w[2] > 0) || (c < 0 && w[2] < 0))) return 0;
    return 2 * z / (z + length(alpha[0] * w[0], alpha[1] * w[1], w[2]));
}

// Density of visible normals, for views below the horizon too.
template <class T> T visible(const T* m, const T* wi, const T* alpha) {
    const T c = dot(wi, m);
    if (!(c > 0)) return 0;
    const T x = alpha[0] * wi[0], y = alpha[1] * wi[1], t = length(x, y, wi[2]);
    const T area = wi[2] >= 0 ? t + wi[2] : (x * x + y * y) / (t - wi[2]);  // t + z cancels below the horizon
    return 2 * (c / area) * ggx(m, alpha);
}

template <class T> bool answer(const std::string& function, const std::vector<T>& in, T* out) {
    // Arguments in the order of the vectors' file.
    if (function == "ndf.ggx") *out = ggx(&in[0], &in[3]);
    else if (function == "masking.g1_ggx") *out = g1(&in[0], &in[3], &in[6]);
    else if (function == "sampling.spherical_cap.pdf") *out = visible(&in[0], &in[3], &in[6]);
    else return false;
    return true;
}

// ---- The protocol. ----

template <class T, class Bits> bool group(const std::string& function, unsigned count, unsigned inputs, int digits) {
    std::vector<T> in(inputs);
    for (unsigned n = 0; n < count; n++) {
        unsigned id;
        unsigned long long word;
        if (std::scanf("%x", &id) != 1) return false;
        for (T& x : in) {
            if (std::scanf("%llx", &word) != 1) return false;
            const Bits bits = static_cast<Bits>(word);
            std::memcpy(&x, &bits, sizeof x);
        }
        T out;
        if (!answer(function, in, &out)) continue;  // a test without an answer was not answered
        Bits bits;
        std::memcpy(&bits, &out, sizeof bits);
        std::printf("%x %0*llx\n", id, digits, static_cast<unsigned long long>(bits));
    }
    return true;
}

int main() {
    char function[128], dtype[8], argument[32];
    unsigned count, inputs, outputs, size;
    while (std::scanf(" ggxref-text-1 %127s %7s %u %u %u", function, dtype, &count, &inputs, &outputs) == 5) {
        for (unsigned words = 0; words < inputs; words += size)
            if (std::scanf(" %31[^:]:%u", argument, &size) != 2) return 1;
        std::printf("%s %s\n", function, dtype);
        const bool wide = !std::strcmp(dtype, "f64");
        if (!wide && std::strcmp(dtype, "f32")) {
            std::fprintf(stderr, "no %s here: ask with --dtypes f32,f64\n", dtype);
            return 1;
        }
        if (!(wide ? group<double, std::uint64_t>(function, count, inputs, 16)
                   : group<float, std::uint32_t>(function, count, inputs, 8))) return 1;
    }
}
