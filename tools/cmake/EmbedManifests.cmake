# cmake -DFOLDER=data_manifests -DSOURCE=manifests.cpp -P EmbedManifests.cmake: the manifests as strings of the program,
# so that the installed command needs no file beside it.
cmake_minimum_required(VERSION 3.24)
file(GLOB files ${FOLDER}/*.json)
set(text "#include \"cli/manifest.h\"\n\nnamespace fieldmark::cli {\n\nstd::vector<std::string_view> embedded_manifests() {\n  return {\n")
foreach(file IN LISTS files)
  file(READ ${file} json)
  string(APPEND text "R\"manifest(${json})manifest\",\n")
endforeach()
string(APPEND text "};\n}\n\n}  // namespace fieldmark::cli\n")
file(WRITE ${SOURCE} "${text}")
