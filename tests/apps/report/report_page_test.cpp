// SPDX-License-Identifier: Apache-2.0
// The report's page as headless Chromium shows it.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/mesh.h"
#include "program.h"
#include "report/report_data.h"
#include "tests/fusion/sphere_scene.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

constexpr int kWidth = 1280, kHeight = 1000;

struct Shown {
  Picture picture;  // kWidth x kHeight
  std::string dom, console;
};

// The page as headless Chromium shows it, with software WebGL. `address` comes after the '#'.
Shown Show(const fs::path& html, const std::string& address) {
  TemporaryFolder folder;
  const fs::path shot = folder / "shot.png";
  const Outcome outcome =
      Process({"chromium", "--headless", "--no-sandbox", "--use-angle=swiftshader",
               "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-prefers-reduced-motion",
               "--virtual-time-budget=2000", "--user-data-dir=" + (folder / "profile").string(),
               "--enable-logging=stderr", "--v=0",
               "--window-size=" + std::to_string(kWidth) + "," + std::to_string(kHeight),
               "--screenshot=" + shot.string(), "--dump-dom", "file://" + html.string() + "#" + address})
          .Wait(140);
  if (!fs::exists(shot)) throw std::runtime_error("chromium took no picture:\n" + outcome.err);
  Shown shown{ReadPicture(shot), outcome.out, ""};
  for (std::size_t at = 0; (at = outcome.err.find("CONSOLE", at)) != std::string::npos; ++at)
    shown.console += outcome.err.substr(at, outcome.err.find('\n', at) - at) + "\n";
  return shown;
}

// The share of the pixels where the cloud is shown that differ clearly between two pictures.
double ShareChanged(const Picture& a, const Picture& b) {
  int changed = 0, all = 0;
  for (int y = 350; y < 700; ++y)
    for (int x = 60; x < 820; ++x, ++all)
      for (std::size_t plane = 0; plane < 3; ++plane)
        if (std::abs(a.planes[plane](x, y) - b.planes[plane](x, y)) > 40) {
          ++changed;
          break;
        }
  return double(changed) / all;
}

// What an attribute of the page's root says.
std::string RootAttribute(const std::string& dom, const std::string& name) {
  const std::size_t at = dom.find("data-" + name + "=\"");
  if (at == std::string::npos) return "(nothing)";
  const std::size_t begin = dom.find('"', at) + 1;
  return dom.substr(begin, dom.find('"', begin) - begin);
}

class Report3d : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasProgram("chromium")) GTEST_SKIP() << "chromium is not installed";
    WriteToyScan(scan(), 6);
  }
  fs::path scan() const { return folder_ / "scan"; }

 private:
  TemporaryFolder folder_;
};

TEST_F(Report3d, ShowsTheCloudAndReportsNoError) {
  Report(scan());
  const Shown shown = Show(scan() / "report.html", "theme=light");
  EXPECT_EQ(shown.console, "");
  EXPECT_NE(shown.dom.find("data-ready=\"yes\""), std::string::npos);
  EXPECT_EQ(shown.dom.find("data-error"), std::string::npos);
  EXPECT_NE(shown.dom.find("One view did not register: &lt;ball&gt; &amp; table"), std::string::npos);
  int stripes = 0;  // the ball's orange, anywhere where the cloud is shown
  for (int y = 350; y < 700; ++y)
    for (int x = 60; x < 820; ++x)
      stripes += shown.picture.planes[0](x, y) > 1.7f * shown.picture.planes[2](x, y);
  EXPECT_GT(stripes, 2000);
}

TEST_F(Report3d, AnotherColourChangesThePicture) {
  Report(scan());
  const Picture colour = Show(scan() / "report.html", "theme=light&colour=colour").picture;
  const Picture again = Show(scan() / "report.html", "theme=light&colour=colour").picture;
  EXPECT_LT(ShareChanged(colour, again), 0.001);
  for (const char* layer : {"normal", "confidence"})
    EXPECT_GT(ShareChanged(colour,
                           Show(scan() / "report.html", std::string("theme=light&colour=") + layer).picture),
              0.02)
        << layer;
}

// What a script in the page finds when it drags, turns the wheel, pinches, clicks a camera and presses keys.
constexpr const char* kHands = R"(<script>
const canvas = byId("canvas"), found = {}, near = (a, b) => Math.abs(a - b) < 1e-9;
canvas.setPointerCapture = () => {};
const point = (type, id, x, y, buttons = 1, button = 0) => canvas.dispatchEvent(new PointerEvent(type, { bubbles: true,
  pointerId: id, clientX: canvas.getBoundingClientRect().x + x, clientY: canvas.getBoundingClientRect().y + y, buttons, button }));
const key = (name, shiftKey = false) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key: name, shiftKey }));
viewer.paint();
const yaw = viewer.eye.yaw, distance = viewer.eye.distance;
point("pointerdown", 1, 300, 200); point("pointermove", 1, 360, 200); point("pointerup", 1, 360, 200);
found.drag_right_turns_right = viewer.eye.yaw < yaw && near(viewer.eye.distance, distance);
const at = viewer.eye.project(viewer.eye.scene.center), buttons = 2;
point("pointerdown", 1, 300, 200, 2, 2); point("pointermove", 1, 340, 170, 2, 2); point("pointerup", 1, 340, 170, 0, 2);
viewer.paint();
const moved = viewer.eye.project(viewer.eye.scene.center);
found.right_drag_moves_with_the_hand = Math.abs(moved[0] - at[0] - 40) < 3 && Math.abs(moved[1] - at[1] + 30) < 3;
canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -100, cancelable: true }));
found.wheel_up_comes_nearer = viewer.eye.distance < distance;
const before = viewer.eye.distance;
point("pointerdown", 1, 300, 200); point("pointerdown", 2, 400, 200); point("pointermove", 2, 500, 200);
found.spreading_fingers_halves_the_distance = near(viewer.eye.distance, before / 2);
point("pointerup", 1, 300, 200); point("pointerup", 2, 500, 200);
Object.assign(viewer.eye, viewer.eye.home); viewer.paint();
const c = viewer.frusta.cameras[5], place = viewer.eye.project(c.center);
viewer.on.select(0);
point("pointerdown", 1, place[0], place[1]); point("pointerup", 1, place[0], place[1], 0);
found.click_selects_a_camera = state.view === 5 && byId("selected-name").textContent === data.views[5].name;
key("n"); found.n_is_the_next_camera = state.view === 0;
key("p"); found.p_is_the_one_before = state.view === 5;
const far = viewer.eye.distance; key("+"); found.plus_comes_nearer = viewer.eye.distance < far;
const pitch = viewer.eye.pitch; key("ArrowUp"); found.arrow_up_looks_from_above = viewer.eye.pitch > pitch;
const target = viewer.eye.target; key("ArrowLeft", true); found.shift_arrow_moves = viewer.eye.target !== target;
document.documentElement.dataset.hands = Object.entries(found).filter(([, right]) => !right).map(([name]) => name).join(" ") || "all right";
</script>)";

TEST_F(Report3d, HandsAndKeysTurnMoveZoomAndSelect) {
  std::string html = Report(scan());
  html.insert(html.rfind("</body>"), kHands);
  WriteFileAtomically(scan() / "hands.html", html);
  const Shown shown = Show(scan() / "hands.html", "");
  EXPECT_EQ(shown.console, "");
  EXPECT_EQ(RootAttribute(shown.dom, "hands"), "all right");
}

// What a script finds that switches layers and shapes, opens a camera, and follows what to shoot next.
constexpr const char* kLayers = R"(<script>
const found = {}, button = (box, key) => [...byId(box).children].find((each) => each.dataset.key === key);
const colours = () => {
  const gl = viewer.gl, bytes = new Uint8Array(4 * 400);
  gl.bindBuffer(gl.ARRAY_BUFFER, viewer.layers[viewer.shape].colours);
  gl.getBufferSubData(gl.ARRAY_BUFFER, 0, bytes);
  return bytes.join();
};
const keys = [...byId("colours").children].map((each) => each.dataset.key);
found.all_layers_are_there = keys.join() === "colour,normal,dop,confidence,views,error";
const seen = new Set(), on_mesh = new Set();
for (const key of keys) { button("colours", key).click(); seen.add(colours()); }
found.every_layer_looks_different = seen.size === keys.length;
button("shapes", "mesh").click();
found.the_mesh_is_shown = viewer.shape === "mesh" && button("shapes", "mesh").getAttribute("aria-pressed") === "true";
for (const key of keys.slice(1)) { button("colours", key).click(); on_mesh.add(colours()); }
found.the_mesh_has_the_layers = on_mesh.size === keys.length - 1;
const key = (name) => byId("canvas").dispatchEvent(new KeyboardEvent("keydown", { key: name }));
key("m"); found.m_goes_back_to_the_points = viewer.shape === "cloud";
key("c"); found.c_is_the_next_colour = state.colour === "colour";
document.querySelector("#sky .camera[data-view='3']").dispatchEvent(new MouseEvent("click", { bubbles: true }));
found.a_camera_opens = byId("selected-name").textContent === data.views[3].name;
const strip = [...document.querySelectorAll("#selected .strip button")].map((each) => each.textContent);
found.with_its_maps = ["S0", "Depth", "Normal", "Depth error"].every((label) => strip.includes(label));
const gap = data.findings.list.findIndex((each) => each.kind === "coverage" && each.from);
document.querySelectorAll("#findings li")[gap].querySelector("button").click();
setTimeout(() => {
  found.show_me_looks_from_there = dot(viewer.eye.axes().back, unit(data.findings.list[gap].from)) > 0.99;
  found.curves_are_drawn = document.querySelectorAll("#curves svg").length === 3;
  document.documentElement.dataset.layers = Object.entries(found).filter(([, right]) => !right).map(([name]) => name).join(" ") || "all right";
}, 900);
</script>)";

TEST_F(Report3d, LayersMeshCamerasAndSuggestionsAnswer) {
  WriteMesh(scan() / "mesh.ply", SphereMesh(30));
  const Outcome outcome =
      RunPolarscan({"evaluate", scan().string(), "--truth", (scan() / "mesh.ply").string(), "--crop", "0.2",
                    "--samples", "20000"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::string html = Report(scan());
  html.insert(html.rfind("</body>"), kLayers);
  WriteFileAtomically(scan() / "layers.html", html);
  const Shown shown = Show(scan() / "layers.html", "");
  EXPECT_EQ(shown.console, "");
  EXPECT_EQ(RootAttribute(shown.dom, "layers"), "all right");
}

TEST_F(Report3d, ComparisonOfTwoScansShowsBoth) {
  WriteMesh(scan() / "mesh.ply", SphereMesh(30));
  fs::copy(scan(), scan().parent_path() / "other", fs::copy_options::recursive);
  const fs::path page = scan().parent_path() / "compare.html";
  const Outcome outcome = RunPolarscan(
      {"evaluate", scan().string(), (scan().parent_path() / "other").string(), "--truth",
       (scan() / "mesh.ply").string(), "--crop", "0.2", "--samples", "20000", "--html", page.string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("Comp. (x10^-2)"), std::string::npos) << outcome.err;
  const Shown shown = Show(page, "");
  EXPECT_EQ(shown.console, "");
  EXPECT_EQ(RootAttribute(shown.dom, "ready"), "yes");
  std::size_t pictures = 0;
  for (std::size_t at = 0; (at = shown.dom.find("<figure>", at)) != std::string::npos; ++at) ++pictures;
  EXPECT_EQ(pictures, 12u);  // of six views each
}

TEST_F(Report3d, SaysInWordsWhatTheScanDoesNotHave) {
  fs::remove(scan() / "cloud.ply");
  fs::remove_all(scan() / "dense/stereo");
  Report(scan());
  const Shown cameras_only = Show(scan() / "report.html", "");
  for (const char* words : {"There is no cloud yet.", "There are no depth maps yet.", "data-ready=\"yes\""})
    EXPECT_NE(cameras_only.dom.find(words), std::string::npos) << words;
  EXPECT_EQ(cameras_only.console, "");

  fs::remove_all(scan() / "dense");
  WriteJson(scan() / "scan.json", {{"version", "0.1.0"}});
  Report(scan());
  const Shown nothing = Show(scan() / "report.html", "");
  for (const char* words :
       {"There are no views yet.", "no cloud and no camera poses yet", "data-ready=\"yes\""})
    EXPECT_NE(nothing.dom.find(words), std::string::npos) << words;
  EXPECT_EQ(nothing.console, "");
}

TEST_F(Report3d, CountsStagesInWordsAndWarnsOfAFailedOne) {
  nlohmann::json record = ReadJson(scan() / "scan.json");
  record["stages"]["fusion"]["counts"] = {{"points", 1}, {"mean_confidence", 0.47}, {"neighbour_deg", 3.5}};
  record["stages"]["mesh"] = {{"state", "failed"}, {"error", "nothing to mesh"}};
  WriteJson(scan() / "scan.json", record);
  Report(scan());
  const Shown shown = Show(scan() / "report.html", "");
  EXPECT_NE(shown.dom.find("1 point · mean confidence 0.47<"), std::string::npos);
  EXPECT_NE(shown.dom.find("Mesh failed: nothing to mesh"), std::string::npos);
}

TEST_F(Report3d, TextFromTheScanCannotBecomeMarkup) {
  nlohmann::json record = ReadJson(scan() / "scan.json");
  record["warnings"] = {"</script><script>document.documentElement.dataset.broken='yes'</script>"};
  WriteJson(scan() / "scan.json", record);
  Report(scan());
  const Shown shown = Show(scan() / "report.html", "");
  EXPECT_NE(shown.dom.find("data-ready=\"yes\""), std::string::npos);
  EXPECT_EQ(shown.dom.find("data-broken"), std::string::npos);
}

}  // namespace
}  // namespace polarscan::test
