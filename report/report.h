// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"
#include "pipeline/scan.h"

namespace polarscan {

// Writes one self-contained HTML page about a scan folder (scan.json, dense/ or views/, cloud.ply): the cloud
// in 3D with the cameras, S0, DoP, AoP, depth and normal thumbnails, stage timings, settings and warnings.
// The page opens from disk without a network and stays under 30 MB: large clouds are thinned out (the same
// points every time), the pictures of large sets become smaller. No stage has to be done or sound: the page
// says in words what is missing. Throws Error if the folder has no readable scan.json or the page cannot be
// written.
void WriteReport(const std::filesystem::path& scan_folder, const std::filesystem::path& html,
                 Progress& progress);

// The stage "report" of a scan: WriteReport to its report.html.
void RunReport(Scan& scan);

}  // namespace polarscan
