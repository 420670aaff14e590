# cmake -DFILE=script.py -DNAME=kScript -DNAMESPACE=a::b -DHEADER=script.h -P EmbedText.cmake: a text file as a string
# of the program, so that the installed command needs no file beside it.
cmake_minimum_required(VERSION 3.24)
file(READ ${FILE} text)
file(WRITE ${HEADER} "#pragma once
#include <string_view>

namespace ${NAMESPACE} {
inline constexpr std::string_view ${NAME} = R\"embedded(${text})embedded\";
}  // namespace ${NAMESPACE}
")
