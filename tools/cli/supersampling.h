#pragma once
#include <fieldmark/engine/shape.h>

namespace CLI {
class App;
}

namespace fieldmark::cli {

/// --supersampling N, see RenderOptions::supersampling. @param rays  0 where it is not given
void add_supersampling(CLI::App& app, Index& rays);

}  // namespace fieldmark::cli
