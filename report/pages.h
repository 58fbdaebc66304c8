// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polarscan {

// Web pages as the build found them, one constant a file or list of
// files (report/embed.cmake). The report's page.html holds
// {{title}}, {{style}}, {{data}}, {{cloud}}, {{mesh}} and {{scripts}} where the rest goes; the comparison's
// {{style}} and {{data}}; the preview's is whole.
extern const char kReportHtml[], kReportCss[], kReportScripts[], kCompareHtml[], kPreviewHtml[];

}  // namespace polarscan
