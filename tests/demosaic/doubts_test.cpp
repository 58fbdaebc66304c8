// SPDX-License-Identifier: Apache-2.0
#include "demosaic/doubts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"

namespace polarscan {
namespace {

PolarView View(float s0, float s1, float s2, float redundancy = 0, float noise = 0.003f) {
  PolarView view;
  view.stokes = {{40, 30, s0}, {40, 30, s1}, {40, 30, s2}, {40, 30, noise}};
  view.redundancy = Image<float>(40, 30, redundancy);
  Random random(4);
  for (std::size_t i = 0; i < view.stokes.s0.size(); ++i) {
    view.stokes.s0.pixels()[i] += noise * float(random.Normal());
    view.stokes.s1.pixels()[i] += float(std::sqrt(2)) * noise * float(random.Normal());
    view.stokes.s2.pixels()[i] += float(std::sqrt(2)) * noise * float(random.Normal());
    view.redundancy.pixels()[i] += 2 * noise * float(random.Normal());
  }
  return view;
}

TEST(ViewDoubts, OfSoundLightThereAreNone) {
  for (const PolarView& view : {View(0.5f, 0.1f, 0.1f), View(0.5f, 0.5f, 0), View(0, 0, 0)}) {
    const ViewDoubts doubts = DoubtsOf(view, {});
    EXPECT_LT(doubts.without_light, 0.002);
    EXPECT_LT(doubts.impossible, 0.002);
    EXPECT_LT(doubts.imbalance, 0.005);
    EXPECT_EQ(doubts.clipped, 0);
  }
}

TEST(ViewDoubts, WhatNoLightCanBeIsCounted) {
  EXPECT_GT(DoubtsOf(View(-0.1f, 0, 0), {}).without_light, 0.99);
  EXPECT_GT(DoubtsOf(View(0.2f, 0.2f, 0.2f), {}).impossible, 0.99);
  EXPECT_NEAR(DoubtsOf(View(0.5f, 0.1f, 0, -0.1f), {}).imbalance, 0.2, 0.01);
  PolarView clipped = View(0.5f, 0, 0);
  for (std::size_t i = 0; i < 600; ++i)
    clipped.stokes.noise.pixels()[i] = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(DoubtsOf(clipped, {}).clipped, 0.5, 1e-6);
  EXPECT_EQ(DoubtsOf(clipped, {}).without_light, 0) << "clipped pixels have light";
  Image<std::uint8_t> mask(40, 30);
  for (std::size_t i = 600; i < mask.size(); ++i) mask.pixels()[i] = 255;
  EXPECT_EQ(DoubtsOf(clipped, mask).clipped, 0);
}

}  // namespace
}  // namespace polarscan
