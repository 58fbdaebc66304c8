// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polarscan {

// Web pages as the build found them, one constant a file (apps/embed.cmake). The report's page.html holds
// {{title}}, {{style}}, {{scripts}}, {{data}} and {{cloud}} where the rest goes; the preview's is whole.
extern const char kReportHtml[], kReportCss[], kReportViewerJs[], kReportPageJs[], kPreviewHtml[];

}  // namespace polarscan
