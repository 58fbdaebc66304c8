# cmake -DFOLDER=apps/report_page -DOUTPUT=report_page.cpp -P embed.cmake: the page's files as C++ constants.
function(embed name file)
  file(READ ${FOLDER}/${file} text)
  file(APPEND ${OUTPUT}.part "const char ${name}[] = R\"page(${text})page\";\n")
endfunction()

file(WRITE ${OUTPUT}.part "#include \"apps/report_page.h\"\nnamespace polarscan {\n")
embed(kReportHtml page.html)
embed(kReportCss page.css)
embed(kReportViewerJs viewer.js)
embed(kReportPageJs page.js)
file(APPEND ${OUTPUT}.part "}  // namespace polarscan\n")
file(RENAME ${OUTPUT}.part ${OUTPUT})
