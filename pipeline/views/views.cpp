// SPDX-License-Identifier: Apache-2.0
#include "pipeline/views/views.h"

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "acquisition/input/files.h"
#include "acquisition/input/masks.h"
#include "core/files/files.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/words.h"
#include "pipeline/views/view_pictures.h"
#include "pipeline/views/view_store.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr int kViewsAtOnce = 4, kScaleViews = 8;
// Of the pixels: sound views have none of the first two, some clipped ones; four angles that were taken one
// after the other differ by a percent or two.
constexpr double kMuchWithoutLight = 0.05, kMuchImpossible = 0.2, kMostlyClipped = 0.5, kUnbalanced = 0.05;
constexpr double kScaleQuantile = 0.995, kScalePixels = 50e3;

// S0 of the brightest colour at a regular grid of pixels.
void AddBrightness(const PolarView& view, std::vector<float>& values) {
  const Image<float>& s0 = view.stokes.s0;
  const int stride = std::max(1, int(std::sqrt(double(s0.size()) / kScalePixels)));
  for (int y = 0; y < s0.height(); y += stride)
    for (int x = 0; x < s0.width(); x += stride) {
      float value = s0(x, y);
      for (const Image<float>& colour : view.colour_s0) value = std::max(value, colour(x, y));
      if (value > 0) values.push_back(value);
    }
}

// The views that decide the scale: spread evenly over the set.
std::vector<int> ScaleViews(const Input& input) {
  const int total = int(input.views.size()), count = std::min(total, kScaleViews);
  std::vector<int> views;
  for (int i = 0; i < count; ++i) views.push_back(i * total / count);
  return views;
}

// S0 that becomes white in the pictures of the set.
double MeasureScale(const Input& input, const DemosaicOptions& options, Progress& progress) {
  if (input.kind == InputKind::kPhotos && input.Source(0).first->sensor.clips) return 2;
  std::vector<float> values;
  for (const int view : ScaleViews(input)) {
    progress.Check();
    AddBrightness(MakeView(*input.Source(view).first, ReadView(input, view), options), values);
  }
  if (values.empty()) return 2;
  return Quantile(std::move(values), kScaleQuantile);
}

Image<std::uint8_t> Encode(const Image<float>& s0, double scale) {
  Image<std::uint8_t> encoded(s0.width(), s0.height());
  ParallelFor(0, s0.height(), [&](int y) {
    for (int x = 0; x < s0.width(); ++x) {
      const float value = std::clamp(s0(x, y) / float(scale), 0.0f, 1.0f);
      encoded(x, y) = std::uint8_t(std::lround(255 * std::pow(value, 1 / 2.2f)));
    }
  });
  return encoded;
}

void WritePicture(const fs::path& path, const PolarView& view, double scale) {
  if (view.colour_s0.empty()) return WritePng(path, Encode(view.stokes.s0, scale));
  const auto r = Encode(view.colour_s0[0], scale), g = Encode(view.colour_s0[1], scale),
             b = Encode(view.colour_s0[2], scale);
  Image<Rgb8> picture(r.width(), r.height());
  for (std::size_t i = 0; i < picture.size(); ++i)
    picture.pixels()[i] = {r.pixels()[i], g.pixels()[i], b.pixels()[i]};
  WritePng(path, picture);
}

// Of the files that hold many views each.
using StackHashes = std::map<fs::path, std::uint64_t>;

StackHashes HashStacks(const Input& input, const Progress& progress) {
  StackHashes hashes;
  for (const InputView& view : input.views) {
    if (view.page < 0 || hashes.contains(view.files[0])) continue;
    progress.Check();
    hashes[view.files[0]] = HashFile(view.files[0]);
  }
  return hashes;
}

// Hash of everything that a view is made from, but for its mask and the scale of its picture.
std::uint64_t HashView(const Input& input, const InputView& view, const DemosaicOptions& options,
                       const StackHashes& stacks) {
  const int format = 4;  // of what is written; to be raised when that changes
  std::uint64_t hash = Hash(fmt::format("{} {} {}", format, ToText(Meaning(input)), options.method));
  if (view.page >= 0)
    hash = Hash(fmt::format("page {} of {}", view.page, ToHex(stacks.at(view.files[0]))), hash);
  else
    for (const fs::path& file : view.files) hash = HashFile(file, hash);
  if (view.sums) hash = Hash("sums", hash);
  for (const double exposure : view.exposures) hash = Hash(fmt::format("exposure {}", exposure), hash);
  for (const std::size_t frame : view.frames) hash = Hash(ToHex(input.session->frames[frame].hash), hash);
  return hash;
}

// Without the masks.
std::vector<std::uint64_t> HashPictures(const Input& input, const DemosaicOptions& options,
                                        const Progress& progress) {
  std::vector<std::uint64_t> hashes(input.views.size());
  const StackHashes stacks = HashStacks(input, progress);
  ParallelFor(0, int(hashes.size()), [&](int i) {
    progress.Check();
    hashes[std::size_t(i)] = HashView(*input.Source(i).first, input.views[std::size_t(i)], options, stacks);
  });
  return hashes;
}

std::vector<std::string> WordsOfCopies(const Input& input, const std::vector<std::uint64_t>& hashes) {
  std::map<std::uint64_t, std::vector<std::string>> same;
  for (std::size_t i = 0; i < hashes.size(); ++i) same[hashes[i]].push_back(input.views[i].name);
  std::vector<std::string> words;
  for (const auto& [hash, views] : same)
    if (views.size() > 1)
      words.push_back(
          fmt::format("{} hold the same picture, which counts once: take the copies out", Enumerate(views)));
  return words;
}

// With the masks. Warns of views that hold the same picture.
std::vector<std::uint64_t> HashViews(const Input& input, const DemosaicOptions& options, Progress& progress) {
  std::vector<std::uint64_t> hashes = HashPictures(input, options, progress);
  for (const std::string& words : WordsOfCopies(input, hashes)) progress.Warn(words);
  for (std::size_t i = 0; i < hashes.size(); ++i)
    if (input.views[i].mask) hashes[i] = HashFile(*input.views[i].mask, hashes[i]);
  return hashes;
}

// The scale, measured again only if a view that decides it has changed.
double UpdateScale(const Input& input, const DemosaicOptions& options,
                   const std::vector<std::uint64_t>& hashes, ViewStore& store, Progress& progress) {
  std::uint64_t key = 0;
  for (const int view : ScaleViews(input)) key = Hash(ToHex(hashes[std::size_t(view)]), key);
  if (const auto scale = store.Scale(ToHex(key))) return *scale;
  const double scale = MeasureScale(input, options, progress);
  store.SetScale(ToHex(key), scale);
  return scale;
}

ViewDoubts WriteView(const Input& input, int index, const DemosaicOptions& options, double scale,
                     bool pictures, ViewStore& store, const Progress& progress) {
  const LoadedView loaded = ReadView(input, index);
  progress.Check();
  const PolarView view = MakeView(*input.Source(index).first, loaded, options);
  progress.Check();
  WriteStokes(store.StokesPath(loaded.name), view.stokes);
  WritePicture(store.PicturePath(loaded.name), view, scale);
  if (pictures) WriteViewPictures(store.PicturesFolder(loaded.name), view, scale);
  if (loaded.mask.empty()) {
    fs::remove(store.MaskPath(loaded.name));
  } else {
    WritePng(store.MaskPath(loaded.name), loaded.mask);
  }
  return DoubtsOf(view, loaded.mask);
}

// Calls f for every element, a few at once: what they hold in memory is bounded.
template <class F>
void ForEachBounded(const std::vector<int>& items, F&& f) {
  const auto tokens = std::size_t(std::clamp(tbb::info::default_concurrency(), 1, kViewsAtOnce));
  std::size_t next = 0;
  tbb::parallel_pipeline(
      tokens, tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) {
                if (next < items.size()) return items[next++];
                control.stop();
                return -1;
              }) & tbb::make_filter<int, void>(tbb::filter_mode::parallel, f));
}

}  // namespace

void ViewFaults::Add(const std::string& view, const ViewDoubts& doubts) {
  if (doubts.without_light > kMuchWithoutLight) without_light_.insert(view);
  if (doubts.impossible > kMuchImpossible) impossible_.insert(view);
  if (doubts.clipped > kMostlyClipped) clipped_.insert(view);
  if (doubts.imbalance > kUnbalanced) unbalanced_.insert(view);
}

std::vector<std::string> ViewFaults::Words(const Input& input) const {
  std::vector<std::string> words;
  const auto say = [&](const std::set<std::string>& views, const std::string& what, const std::string& cure) {
    if (!views.empty())
      words.push_back(fmt::format("{} view{} {}: {}. {}", views.size(), views.size() == 1 ? " has" : "s have",
                                  what, Enumerate({views.begin(), views.end()}, 5), cure));
  };
  const bool stokes = input.kind == InputKind::kStokes;
  say(without_light_,
      fmt::format("less than no light in {:.0f} % of the pixels or more (S0 below 0 or no number)",
                  100 * kMuchWithoutLight),
      stokes ? "Are these Stokes images, and is S0 the first?"
             : "Is --black-level right, and was the lens uncovered?");
  say(impossible_,
      fmt::format("more polarized light than light in {:.0f} % of the pixels or more (a degree above 1)",
                  100 * kMuchImpossible),
      stokes ? "Are these S0, S1, S2 in this order and on one scale, and not the light behind polarizers?"
      : input.kind == InputKind::kRgbAopDop
          ? "Degrees go from 0 to 1 (or to full scale of their files), not to 100"
          : "Is each picture that of its angle, and the black level right?");
  say(clipped_, "nothing in most of the pixels: they are clipped, or no number",
      "Expose less, or check --white-level and --bits");
  say(unbalanced_,
      fmt::format(
          "pictures behind the four angles that do not belong together: I0 + I90 and I45 + I135 differ by "
          "{:.0f} % and more",
          100 * kUnbalanced),
      "Is one of another exposure, of another angle, or of another view?");
  return words;
}

std::vector<std::string> SamePictures(const Input& input, const Progress& progress) {
  return WordsOfCopies(input, HashPictures(input, {}, progress));
}

void MakeStokesViews(const Input& input, const fs::path& folder, const DemosaicOptions& options,
                     Progress& progress, bool pictures) {
  FindDemosaicMethod(options.method);
  TellNotes(input, progress);
  for (const std::string& odd : CheckMasks(input, progress)) progress.Warn(odd);
  const std::vector<std::uint64_t> hashes = HashViews(input, options, progress);
  ViewStore store(folder);
  store.Describe(ToString(input.kind), input.polarized());
  const double scale = UpdateScale(input, options, hashes, store, progress);

  std::vector<std::string> names;
  std::vector<int> todo;
  const auto has_pictures = [&](int i) {  // those of an earlier run are kept as the views are
    return pictures || fs::exists(store.PicturesFolder(input.views[std::size_t(i)].name));
  };
  const auto key = [&](int i) {
    const std::string shown = fmt::format("{}{}", scale, has_pictures(i) ? " pictures" : "");
    return ToHex(Hash(shown, hashes[std::size_t(i)]));
  };
  for (int i = 0; i < int(input.views.size()); ++i) {
    names.push_back(input.views[std::size_t(i)].name);
    if (!store.IsValid(names.back(), key(i))) todo.push_back(i);
  }
  store.RemoveAllBut(names);
  store.Begin(names);

  std::mutex mutex;
  ViewFaults doubtful;

  progress.Begin("Stokes views", todo.size());
  ForEachBounded(todo, [&](int i) {
    progress.Check();
    const ViewDoubts doubts = WriteView(input, i, options, scale, has_pictures(i), store, progress);
    {
      const std::lock_guard lock(mutex);
      doubtful.Add(input.views[std::size_t(i)].name, doubts);
    }
    store.Record(input.views[std::size_t(i)].name, key(i));
    progress.Advance();
  });
  for (const std::string& words : doubtful.Words(input)) progress.Warn(words);
}

}  // namespace polarscan
