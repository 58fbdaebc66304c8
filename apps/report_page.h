// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polarscan {

// The report's page as the build found it in apps/report_page/ (one constant a file;
// apps/report_page/embed.cmake). page.html holds {{title}}, {{style}}, {{scripts}}, {{data}} and {{cloud}}
// where the rest goes.
extern const char kReportHtml[], kReportCss[], kReportViewerJs[], kReportPageJs[];

}  // namespace polarscan
