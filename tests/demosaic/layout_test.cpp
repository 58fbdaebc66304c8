// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/layout.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "mosaic.h"

namespace polarscan {
namespace {

TEST(Layout, IsReadInTheUsualSpellings) {
  const Layout sony = {{90, 45, 135, 0}, ""};
  for (const char* text : {"90 45 / 135 0", "90,45,135,0", "90 45 135 0", " 90, 45 / 135, 0 ", "90;45;135;0"})
    EXPECT_EQ(ParseLayout(text), sony) << text;
  EXPECT_EQ(ParseLayout("0 45 / 135 90 RGGB"), (Layout{{0, 45, 135, 90}, "rggb"}));
}

TEST(Layout, AnythingElseIsAnErrorThatShowsARightOne) {
  for (const char* text : {"", "90 45 / 135", "90 45 / 135 0 rgbb", "90 45 / 135 135", "90 45 135 0 rggb 1",
                           "0 60 120 180", "sony", "90 45 / 135 00", "90x45 135 0"}) {
    try {
      ParseLayout(text);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("\"90 45 / 135 0\""), std::string::npos) << error.what();
    }
  }
}

TEST(Layout, EveryLayoutSurvivesBeingWrittenAndRead) {
  for (const char* bayer : {"", "rggb", "bggr", "grbg", "gbrg"})
    for (const Layout& layout : test::AllLayouts(bayer)) EXPECT_EQ(ParseLayout(ToString(layout)), layout);
}

TEST(Layout, ColourSensorsHaveBlocksOfOneColour) {
  const Layout layout = ParseLayout("90 45 / 135 0 rggb");
  const char* rows[4] = {"rrgg", "rrgg", "ggbb", "ggbb"};
  const int angles[4][4] = {{90, 45, 90, 45}, {135, 0, 135, 0}, {90, 45, 90, 45}, {135, 0, 135, 0}};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      EXPECT_EQ(layout.ColourAt(x, y), rows[y][x]);
      EXPECT_EQ(layout.AngleAt(x, y), angles[y][x]);
    }
}

}  // namespace
}  // namespace polarscan
