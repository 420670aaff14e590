#include "cli/turntable.h"

#include <fieldmark/core/base64.h>
#include <fieldmark/core/error.h>
#include <fieldmark/imaging/markup.h>

namespace fieldmark::cli {
namespace {

constexpr char kHead[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body { margin: 0; min-height: 100vh; display: flex; flex-direction: column; align-items: center;
  justify-content: center; gap: 1rem; font: 1rem/1.5 system-ui, sans-serif; }
img { max-width: 100vw; max-height: 85vh; width: 640px; object-fit: contain; cursor: grab; touch-action: none;
  user-select: none; -webkit-user-drag: none; }
p { margin: 0; }
</style>
)";

constexpr char kScript[] = R"(<script>
const view = document.getElementById("view");
let row = Math.floor((rows - 1) / 2), column = closed ? 0 : Math.floor((columns - 1) / 2);
const clamp = (i, n) => Math.min(Math.max(i, 0), n - 1);
function show(r, c) {
  row = clamp(r, rows);
  column = closed ? ((c % columns) + columns) % columns : clamp(c, columns);
  view.src = "data:image/jpeg;base64," + images[row * columns + column];
}
let from = null;
view.addEventListener("pointerdown", e => {
  from = { x: e.clientX, y: e.clientY, row, column };
  view.setPointerCapture(e.pointerId);
});
view.addEventListener("pointermove", e => {
  if (!from) return;
  const turn = (from.x - e.clientX) / view.clientWidth, tilt = (from.y - e.clientY) / view.clientHeight;
  show(from.row + Math.round(tilt * rows * 1.5), from.column + Math.round(turn * columns));
});
for (const end of ["pointerup", "pointercancel"]) view.addEventListener(end, () => { from = null; });
addEventListener("keydown", e => {
  if (e.altKey || e.ctrlKey || e.metaKey) return;
  const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };
  if (!(e.key in steps)) return;
  e.preventDefault();
  show(row + steps[e.key][0], column + steps[e.key][1]);
});
show(row, column);
</script>
</body>
</html>
)";

}  // namespace

std::string turntable_page(const CameraGrid& grid, const std::vector<std::vector<std::byte>>& jpegs,
                           const std::string& title, bool dark) {
  if (std::ssize(jpegs) != grid.rows * grid.columns || jpegs.empty())
    throw ShapeError("[turntable_page] jpegs must be rows x columns, " +
                     std::to_string(grid.rows * grid.columns) + ", got " + std::to_string(jpegs.size()));
  const std::string name = bench::escaped_markup(title);
  std::string page = kHead;
  page += "<title>" + name + "</title>\n</head>\n<body style=\"" +
          (dark ? "background: #000; color: #ddd" : "background: #fff; color: #222") +
          "\">\n<img id=\"view\" draggable=\"false\" alt=\"View of " + name +
          "\" src=\"data:,\">\n<p>Drag, or use the arrow keys, to turn.</p>\n<script>\nconst rows = " +
          std::to_string(grid.rows) + ", columns = " + std::to_string(grid.columns) +
          ", closed = " + (grid.closed ? "true" : "false") + ", images = [\n";
  for (const auto& jpeg : jpegs) page += "\"" + to_base64(jpeg) + "\",\n";
  page += "];\n</script>\n";
  page += kScript;
  return page;
}

}  // namespace fieldmark::cli
