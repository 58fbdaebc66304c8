// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fake_colmap.h"
#include "stereo/sfm/sfm.h"

namespace polarscan {

inline constexpr int kViews = 10;

// Ten views, and a COLMAP that places them all unless a test wants otherwise.
class Sfm : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    WriteViews(folder / "views", views);
    options.colmap = colmap().program();
    for (const DenseView& view : views) names.push_back(view.name + ".png");
    colmap().ExtractorWrites(names, 1000, kViews);
    colmap().MapperWrites({Registered(0, kViews)});
  }
  FakeColmap& colmap() {
    if (!colmap_) colmap_ = std::make_unique<FakeColmap>(folder / "fake", "3.8");
    return *colmap_;
  }
  // A model of the views begin .. end-1.
  SparseModel Registered(int begin, int end) const {
    return ModelOf({views.begin() + begin, views.begin() + end});
  }
  SparseModel Run() { return EstimatePoses(folder / "views", folder / "sfm", known, options, progress); }
  std::string RunError() {
    return ErrorOf([this] { Run(); });
  }

  std::vector<DenseView> views = Ring(kViews);
  std::vector<std::string> names;
  std::optional<std::filesystem::path> known;
  SfmOptions options;
  Listener progress;

 private:
  std::unique_ptr<FakeColmap> colmap_;
};

inline bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace polarscan
