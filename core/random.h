// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace polarscan {

// Counter-based random numbers: the n-th draw is a pure function of the key, so results do not depend on
// threads or order. The mixer is SplitMix64's finalizer (Steele, Lea, Flood, OOPSLA 2014), applied once per
// key word and draw.
class Random {
 public:
  // The key says who draws: typically (seed, view, pixel, iteration).
  explicit Random(std::uint64_t seed, std::uint64_t a = 0, std::uint64_t b = 0, std::uint64_t c = 0)
      : key_(Mix(Mix(Mix(Mix(seed) + a) + b) + c)) {}

  std::uint64_t Next64() { return Mix(key_ + 0x9E3779B97F4A7C15ull * ++counter_); }
  // Uniform in [0, 1).
  double Uniform() { return double(Next64() >> 11) * 0x1.0p-53; }
  float Uniform(float low, float high) { return low + (high - low) * float(Uniform()); }
  // Uniform in 0 .. n-1 (bias below 2^-32 for n < 2^32).
  std::uint32_t Below(std::uint32_t n) { return std::uint32_t(((Next64() >> 32) * n) >> 32); }
  // Normal with mean 0 and standard deviation 1 (Box-Muller; two draws a number).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  static std::uint64_t Mix(std::uint64_t z) {
    z += 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  std::uint64_t key_, counter_ = 0;
};

}  // namespace polarscan
