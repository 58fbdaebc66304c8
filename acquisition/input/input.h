// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/session/session_reader.h"
#include "core/formats/image_io.h"
#include "core/options.h"
#include "core/progress.h"
#include "demosaic/calibration/calibration.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// What the pictures of an INPUT folder cannot tell by themselves. Empty, "auto", negative or zero: not said
// here; then the folder's set.json counts, then the default named in the help. What stays ambiguous is an
// error that names the option.
struct InputOptions {
  std::string kind = "auto";
  std::string layout = "";
  int bits = 0;
  double black_level = -1, white_level = 0;
  double gain = 0, read_noise = -1;
  double gamma = 0;
  std::string aop_sense = "auto";
  std::string aop_scale = "auto";
  std::string calibration = "";
  std::string angles = "";
};
OptionTable Table(InputOptions& options);

enum class InputKind { kMosaic, kAngles, kStokes, kRgbAopDop, kPhotos };
// "mosaic", "angles", "stokes", "rgb-aop-dop", "photos".
std::string ToString(InputKind kind);

// The files of one view: mosaic, photos: one; angles: one each in the order of Input::angles, or one with a
// page or channel each; Stokes: one with several pages or channels or S0, S1, S2; rgb-aop-dop: those three.
struct InputView {
  std::string name;  // core/view_name.h: the view's name in every later stage
  std::vector<std::filesystem::path> files;
  std::optional<std::filesystem::path> mask = {};
  std::vector<std::size_t> frames = {};  // of a session instead of files
  // Of mosaics that were taken with several exposures: of each file or frame, any unit; empty: one exposure.
  std::vector<double> exposures = {};
  int page = -1;      // of files[0], a TIFF that holds a view on each of its pages; -1: it holds one view
  bool sums = false;  // Stokes: the files hold S0, S0 + S1, S0 + S2
};

// An INPUT folder understood, with everything that was decided about it. The forms it may have:
//   mosaic/NAME.png or NAME.png           raw mosaics, grey PNG or TIFF
//   exposure-500/ exposure-4000/ NAME.*   raw mosaics of several exposures (times in one unit), to be merged
//   I-00/ I-45/ I-90/ I-135/ NAME.*       pictures behind a polarizer, angles anticlockwise; also 0/ 60/ 120/
//                                         and other angles, NAME_0.png NAME_60.png ..., or NAME.tif with a
//                                         page or channel an angle
//   NAME.tif                              S0, S1, S2 (and noise) as float32 pages; flat or in stokes/
//   NAME.exr                              channels S0 S1 S2, or S0.R S0.G S0.B and so on; flat or in stokes/
//   NAME_s0.exr NAME_s1.exr NAME_s2.exr   float EXR, TIFF or NPY, grey or colour; flat or in stokes/; or
//                                         folders s0/ s1/ s2/; or NAME_s0.hdr with S0 + S1, S0 + S2 in
//                                         _s0p1 _s0p2
//   rgb/ aop/ dop/ NAME.*                 intensity, angle and degree of polarization
//   session.json, segments/               a recorded session: mosaics, one view a shot (docs/capture.md)
//   NAME.jpg                              photos without polarization; flat or in photos/ or images/
//   views.json NAME.tif                   a folder that polarscan demosaic made: Stokes, or photos if it says so
// where pictures may lie in folders (cam1/NAME.jpg), a TIFF may hold many mosaics or photos on its pages,
// and beside them masks/NAME.* (not black = object; masks.h), sparse/ (COLMAP model with known poses)
// and set.json. Pictures of which a part is transparent bring their own mask where there is no other.
struct Input {
  std::filesystem::path folder;
  InputKind kind = InputKind::kPhotos;
  std::vector<InputView> views;  // sorted by name
  Sensor sensor;
  std::shared_ptr<const Session> session;          // where the views are its shots
  int width = 0, height = 0;                       // of the first view's first picture, px
  CameraBinding binding;                           // mosaics: by which camera and how, as far as it is known
  std::shared_ptr<const Calibration> calibration;  // mosaics: or null
  bool clockwise = false;          // the source's angles of polarization run clockwise; Stokes views never do
  std::string aop_scale = "auto";  // of aop/: see the option table
  std::vector<double> angles = {0, 45, 90,
                                135};  // kind angles: the polarizer's, degrees, as the source counts
  std::optional<std::filesystem::path> known_model;  // sparse/
  std::vector<std::string> notes;                    // what was assumed, one sentence each, for the user
  std::vector<std::string> warnings;                 // what is odd, likewise

  // Several folders that make one set (OpenInputs): each means what it means by itself. The views above are
  // theirs, one folder after the other; the sensor, session and calibration are only in the parts.
  std::vector<Input> parts = {};
  // The folder that a view comes from, and which of its views it is.
  std::pair<const Input*, int> Source(int view) const;

  bool polarized() const { return kind != InputKind::kPhotos; }
  // Whether a session lost something that it had stored; the warnings say what.
  bool damaged() const;
  // What is known about the single pixels; empty without a calibration.
  const MosaicCorrection& correction() const;
};

// Throws Error if the folder is missing, empty, incomplete or ambiguous, or the calibration is another
// camera's. Opens one view's pictures (eight views' to find out about 16-bit ones, and where the sensor
// saturates); the others are read by ReadView.
Input OpenInput(const std::filesystem::path& folder, const InputOptions& options);
// The same with progress where the whole of a session is read. Throws Cancelled, too.
Input OpenInput(const std::filesystem::path& folder, const InputOptions& options, Progress& progress);

// One set from several folders. Where two have views of the same name, every view's begins with its folder's
// name. Known poses are not used: each folder's have a frame of their own. Throws Error also if only some of
// the folders know polarization.
Input OpenInputs(const std::vector<std::filesystem::path>& folders, const InputOptions& options,
                 Progress& progress);

// Warns of what is odd and says what was assumed.
void TellNotes(const Input& input, Progress& progress);

// {"kind", "sensor", "aop_sense", "aop_scale", "calibration"}: everything that decides what a view's pictures
// mean.
nlohmann::json Meaning(const Input& input);
// The above with folder, counts and notes, for scan.json.
nlohmann::json ToJson(const Input& input);

// One view's pictures in the order of InputView::files (pages of a Stokes file: one picture each; mosaics of
// several exposures: one an exposure), all of one size.
struct LoadedView {
  std::string name;
  std::vector<Picture> pictures;
  Image<std::uint8_t> mask;            // 0 or 255; empty: none
  std::vector<double> exposures = {};  // of each picture, where a mosaic has several
};

// Throws Error if a file is damaged, or its size, channels or depth do not fit the others or the settings.
LoadedView ReadView(const Input& input, int view);

// A raw mosaic's light: calibrated where there is a calibration, merged where there are several exposures.
LitMosaic MosaicOf(const Input& input, const LoadedView& view);

}  // namespace polarscan
